"""Laws as Fortran: the law's own subroutine, and subroutine CREEP around it."""
