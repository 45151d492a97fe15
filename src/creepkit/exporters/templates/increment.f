!
! ---------------------------------------------------------------
! Creep over one increment at constant stress: the implicit mid-
! point rule in the transformed time s = t**beta, in which creep
! begins as a straight line: t = 0 and zero strain are regular.
! t is the time of the law or, where that does not matter and there
! is no creep strain as yet, the time since the increment began.
! The strain at the end is solved for here (Newton in ln of the
! increment); where that fails the step is halved, and halved again.
! The very first increment, in which a sum of terms is smooth in no
! such time, is taken in 16 steps. Derivatives are those of the
! converged update, by the implicit function theorem.
!   y     creep strain gained (0 at the start), internal variables
!   slope derivatives of y at the end: to the stress (MPa), and to
!         the mean stress (MPa)
! ---------------------------------------------------------------
      subroutine ${id}_increment(start, finish, temps, stress, mean,
     &    strain, y, slope)
        implicit none
        integer, parameter :: ny = $ny
        double precision, intent(in) :: start, finish, temps($nt)
        double precision, intent(in) :: stress, mean, strain
        double precision, intent(inout) :: y(ny)
        double precision, intent(out) :: slope(ny, 2)
        double precision, parameter :: beta = $beta
        double precision low, high, place, most, size, point($np)
        double precision origin
        logical solved
        origin = 0.0d0
$shift_origin        low = max(start - origin, 0.0d0)**beta
        high = max(finish - origin, 0.0d0)**beta
        point(1:7) = (/ start, finish - start, temps(1), temps(2), beta,
     &      strain, origin /)
$carried        slope = 0.0d0
        most = high - low
        if (.not. low > 0.0d0) most = most/16
        place = low
        size = most
        do
          size = min(size, high - place)
          if (.not. size > 1.0d-12*high) return
          call ${id}_step(place, size, point, stress, mean,
     &        size <= (high - low)/4096, y, slope, solved)
          if (solved) then
            place = place + size
            size = min(2*size, most)
          elseif (size > (high - low)/4096) then
            size = 0.5d0*size
          else
            call ${id}_rupture(place, high - place, point, stress,
     &          mean, y, slope)
            return
          endif
        enddo
      end subroutine ${id}_increment
!
! One step of that time, from s to s + ds; y and slope stay as they
! are where it has no solution. One with a diagonal term of Newton's
! matrix below zero is none: a variable that feeds its own growth
! runs backwards in it, as the step is too long. So is one in whose
! second half a rate changes by a quarter, unless it is the smallest.
!
      subroutine ${id}_step(s, ds, point, stress, mean, smallest, y,
     &    slope, solved)
        implicit none
        integer, parameter :: ny = $ny, nx = $nx
        double precision, intent(in) :: s, ds, point($np), stress, mean
        logical, intent(in) :: smallest
        double precision, intent(inout) :: y(ny), slope(ny, 2)
        logical, intent(out) :: solved
        double precision x($mx), out(ny*(1 + nx)), a(ny, ny)
        double precision r(ny, 3), z(ny), grown, h, least
        double precision moved(ny), again(ny*(1 + nx)), hend
        integer i, pass
        call ${id}_place(s, ds, point, stress, mean, x, h)
        z = y
        call ${id}_look(x, point(6), y, z, 0.0d0, out)
        z(1) = min(max(log(h) + out(1), -690.0d0), 50.0d0)
        do pass = 1, 40
          grown = exp(z(1))
          call ${id}_look(x, point(6), y, z, grown, out)
          call ${id}_equations(y, z, grown, h, out, slope, a, r)
          least = minval((/ (a(i, i), i = 1, ny) /))
          call ${id}_solve(a, r)
          z = z + r(:, 1)
          z(1) = min(max(z(1), -700.0d0), 50.0d0)
          if (.not. maxval(abs(r(:, 1))) < 1.0d10) exit
          if (maxval(abs(r(:, 1))/(1.0d-3 + abs(z))) < 1.0d-11) exit
        enddo
        solved = maxval(abs(r(:, 1))/(1.0d-3 + abs(z))) < 1.0d-8
        solved = solved .and. z(1) < 0.0d0 .and. least > 0.0d0
        if (.not. solved) return
        grown = exp(z(1))
        if (.not. smallest) then
          moved = z
          moved(1) = y(1) + grown
          call ${id}_place(s + 0.5d0*ds, ds, point, stress, mean, x,
     &        hend)
          call ${id}_look(x, point(6), moved, moved, 0.0d0, again)
          solved = abs(log(hend/h) + again(1) - out(1)) < 0.25d0 .or.
     &        max(out(1), again(1)) + log(h) < -600.0d0
          moved = hend*again(1:ny) - h*out(1:ny)
          solved = solved .and. all(abs(moved(2:)) <= 1.0d-3 +
     &        0.25d0*h*abs(out(2:ny)))
          if (.not. solved) return
        endif
        slope(1, :) = slope(1, :) + grown*r(1, 2:3)
        y(1) = y(1) + grown
        slope(2:, :) = r(2:, 2:3)
        y(2:) = z(2:)
        call ${id}_hold(y, slope)
      end subroutine ${id}_step
!
! The middle of a step of that time: point x of the law, and the
! time h that the step amounts to at the rate there.
!
      subroutine ${id}_place(s, ds, point, stress, mean, x, h)
        implicit none
        double precision, intent(in) :: s, ds, point($np), stress, mean
        double precision, intent(out) :: x($mx), h
        double precision middle, time, elapsed
        middle = s + 0.5d0*ds
        elapsed = middle**(1.0d0/point(5))
        time = point(7) + elapsed
        h = ds*elapsed/(point(5)*middle)
        x = 0.0d0
        x(1) = stress
        x(3) = time
        x(4) = point(3)
        if (point(2) > 0.0d0) x(4) = point(3) + (point(4) - point(3))*
     &      (time - point(1))/point(2)
        x(5) = stress
        x(6) = mean
$placed      end subroutine ${id}_place
!
! The last resort, when even the smallest step has no solution: the
! material ruptures. States go to their limits, and the strain grows
! at the rate there, by no more than 1.
!
      subroutine ${id}_rupture(s, ds, point, stress, mean, y, slope)
        implicit none
        integer, parameter :: ny = $ny, nx = $nx
        double precision, intent(in) :: s, ds, point($np), stress, mean
        double precision, intent(inout) :: y(ny), slope(ny, 2)
        double precision x($mx), out(ny*(1 + nx)), grown, h, ends(ny)
        double precision sides(ny)
        integer i
        call ${id}_place(s, ds, point, stress, mean, x, h)
        call ${id}_limits(ends, sides)
        do i = 2, ny
          if (abs(ends(i)) < 1.0d300) y(i) = ends(i)
        enddo
        call ${id}_look(x, point(6), y, y, 0.0d0, out)
        grown = exp(min(log(h) + out(1), 0.0d0))
        y(1) = y(1) + grown
        slope = 0.0d0
        slope(1, :) = grown*(/ out(1 + ny), out(6 + ny) /)
      end subroutine ${id}_rupture
!
! The law halfway between y and its end (y + grown, z); a state at
! its limit stays there.
!
      subroutine ${id}_look(x, strain, y, z, grown, out)
        implicit none
        integer, parameter :: ny = $ny, nx = $nx
        double precision, intent(inout) :: x($mx)
        double precision, intent(in) :: strain, y(ny), z(ny), grown
        double precision, intent(out) :: out(ny*(1 + nx))
        double precision w(ny), slope(ny, 2)
        slope = 0.0d0
        x(2) = strain + y(1) + 0.5d0*grown
        w = 0.5d0*(y + z)
        call ${id}_hold(w, slope)
        x(7:nx) = w(2:)
        call ${id}_law(x, out)
      end subroutine ${id}_look
!
! Newton's equations: a times the change of (ln of the increment,
! states) is r(:, 1); r(:, 2:3) are what stress and mean stress do.
!
      subroutine ${id}_equations(y, z, grown, h, out, slope, a, r)
        implicit none
        integer, parameter :: ny = $ny, nx = $nx
        double precision, intent(in) :: y(ny), z(ny), grown, h
        double precision, intent(in) :: out(ny*(1 + nx)), slope(ny, 2)
        double precision, intent(out) :: a(ny, ny), r(ny, 3)
        double precision g(ny), d(ny, nx), ends(ny), size, lnh
        double precision sides(ny)
        integer i, j
        call ${id}_limits(ends, sides)
        lnh = log(h)
        g = out(1:ny)
        do i = 1, ny
          d(i, :) = out(ny + (i - 1)*nx + 1:ny + i*nx)
        enddo
        r(1, 1) = max(lnh + g(1), -690.0d0) - z(1)
        do i = 1, ny
          size = 1.0d0
          if (i > 1) size = h
          a(i, 1) = -0.5d0*size*grown*d(i, 2)
          if (ny > 1) a(i, 2:) = -0.5d0*size*d(i, 7:)
          r(i, 2) = size*(d(i, 1) + d(i, 2)*slope(1, 1))
          r(i, 3) = size*(d(i, 6) + d(i, 2)*slope(1, 2))
          do j = 2, ny
            r(i, 2:3) = r(i, 2:3) + 0.5d0*size*d(i, 5 + j)*slope(j, :)
          enddo
        enddo
        a(1, 1) = 1.0d0 + a(1, 1)
        do i = 2, ny
          a(i, i) = 1.0d0 + a(i, i)
          r(i, 1) = y(i) + h*g(i) - z(i)
          r(i, 2:3) = r(i, 2:3) + slope(i, :)
          if (sides(i)*(y(i) - ends(i)) >= 0.0d0) then
            a(i, :) = 0.0d0
            a(i, i) = 1.0d0
            r(i, :) = 0.0d0
          endif
        enddo
        if (g(1) + lnh < -690.0d0) then
          a(1, 2:) = 0.0d0
          a(1, 1) = 1.0d0
          r(1, 2:3) = 0.0d0
        endif
      end subroutine ${id}_equations
!
! Hold states at the values at which the material has failed.
!
      subroutine ${id}_hold(y, slope)
        implicit none
        integer, parameter :: ny = $ny
        double precision, intent(inout) :: y(ny), slope(ny, 2)
        double precision ends(ny), sides(ny)
        integer i
        call ${id}_limits(ends, sides)
        do i = 2, ny
          if (sides(i)*(y(i) - ends(i)) >= 0.0d0) then
            y(i) = ends(i)
            slope(i, :) = 0.0d0
          endif
        enddo
      end subroutine ${id}_hold
! Where the material has failed, and whether above (1) or below (-1).
!
      subroutine ${id}_limits(ends, sides)
        implicit none
        double precision, intent(out) :: ends($ny), sides($ny)
$limits
      end subroutine ${id}_limits
!
! Gaussian elimination with pivots: r becomes a**(-1) r.
!
      subroutine ${id}_solve(a, r)
        implicit none
        integer, parameter :: ny = $ny
        double precision, intent(inout) :: a(ny, ny), r(ny, 3)
        double precision row(ny), right(3), share
        integer i, k, p
        do k = 1, ny
          p = k - 1 + maxloc(abs(a(k:, k)), 1)
          row = a(k, :)
          a(k, :) = a(p, :)
          a(p, :) = row
          right = r(k, :)
          r(k, :) = r(p, :)
          r(p, :) = right
          do i = k + 1, ny
            share = a(i, k)/a(k, k)
            a(i, :) = a(i, :) - share*a(k, :)
            r(i, :) = r(i, :) - share*r(k, :)
          enddo
        enddo
        do k = ny, 1, -1
          do i = k + 1, ny
            r(k, :) = r(k, :) - a(k, i)*r(i, :)
          enddo
          r(k, :) = r(k, :)/a(k, k)
        enddo
      end subroutine ${id}_solve
