"""Model clients (servers, local models, scripts) and the wrappers around them."""
