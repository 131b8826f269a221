"""er-gym as an OpenEnv server; the variable ER_GYM_OPENENV holds its settings as JSON."""

import uvicorn

from er_gym.integrations.openenv import app_of_variable

app = app_of_variable()


def main(host: str = "0.0.0.0", port: int = 8000) -> None:
    """Serve until Ctrl-C."""
    uvicorn.run(app, host=host, port=port, ws_max_size=2**20)


if __name__ == "__main__":
    main()
