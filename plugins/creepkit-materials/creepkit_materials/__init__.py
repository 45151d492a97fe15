"""Published creep laws of materials, a module for each; every number was read in the source that is named with it."""
