"""The paper's ladder: collect, imitate, explore, reflect, and measure after each stage."""
