"""Materials to be cut that are shipped with leafcut, one TOML file each."""
