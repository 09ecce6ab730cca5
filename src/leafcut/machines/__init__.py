"""Machine profiles shipped with leafcut, one TOML file each."""
