"""The public verbs, as typed in a notebook; each looks up names in the registry and passes the work on."""
