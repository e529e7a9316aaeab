"""The environments' names in Gymnasium."""

import gymnasium

#: Each name and its configuration. Hover-v0: the four inputs of the wing beat, nobody else steers. Hover-v1: both motors' voltages.
#: Escape-v0 and Waypoints-v0: what a policy adds to the controller. Fly-v0: any configuration, `config="my_fly.toml"`.
CONFIGS = {
    "Hover-v0": "fly/hover_direct.toml",
    "Hover-v1": "fly/hover_voltages.toml",
    "Escape-v0": "fly/escape.toml",
    "Waypoints-v0": "fly/waypoints.toml",
    "Fly-v0": None,
}


def register() -> None:
    """Registers `flappy/...`; `import flappy` has done it, as has Gymnasium where the package is installed."""
    for name, config in CONFIGS.items():
        full = f"flappy/{name}"
        if full in gymnasium.registry:
            continue
        gymnasium.register(
            full,
            entry_point="flappy.envs:FlappyEnv",
            vector_entry_point="flappy.envs:FlappyVectorEnv",
            kwargs={} if config is None else {"config": config},
        )
