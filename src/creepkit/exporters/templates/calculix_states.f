!
! ---------------------------------------------------------------
! Internal variables between increments: CalculiX hands CREEP those
! at the start of an increment and takes none back. They are stored
! here for each integration point, at the start and at the end of
! the latest increment; whether a call belongs to that increment
! (an iteration, or a shorter one after a failure) or to the next
! one follows from the time at which it starts.
! ---------------------------------------------------------------
      subroutine ${id}_stored(noel, npt, start, finish, saving, w)
        implicit none
        integer, parameter :: ns = $ns, points = 27
        integer, parameter :: elements = 20000
        integer, intent(in) :: noel, npt
        double precision, intent(in) :: start, finish
        logical, intent(in) :: saving
        double precision, intent(inout) :: w(ns)
        double precision, save :: stored(ns, 2, points, elements) = 0
        double precision, save :: times(2, points, elements) = 0
        if (noel > elements .or. npt > points) then
          write(*, *) '*ERROR in creep: raise the parameter elements',
     &      ' of ${id}_stored above the largest element number, ', noel
          call exit(201)
        endif
        if (saving) then
          stored(:, 2, npt, noel) = w
          times(2, npt, noel) = finish
          return
        endif
        if (abs(start - times(1, npt, noel)) > 1.0d-6*(finish - start)
     &      .or. abs(start - times(2, npt, noel)) <= 1.0d-6*(finish
     &      - start)) then
          stored(:, 1, npt, noel) = stored(:, 2, npt, noel)
          times(1, npt, noel) = start
        endif
        w = stored(:, 1, npt, noel)
      end subroutine ${id}_stored
