"""Who gives a model's turns: servers, this process, scripts; and what is put around them."""
