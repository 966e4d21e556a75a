"""The page docs/configuration.md and the JSON Schemas of configuration files, from their schemas."""
