"""Records of instruments: formats as declarations, clocks aligned with those of cameras, and what was imposed."""
