"""Laws as the input of codes that have creep laws of their own: recognised, converted, or refused with the reason."""
