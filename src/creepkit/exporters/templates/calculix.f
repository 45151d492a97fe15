      subroutine creep(decra, deswa, statev, serd, ec, esw, p, qtild,
     & temp, dtemp, predef, dpred, time, dtime, cmname, leximp, lend,
     & coords, nstatv, noel, npt, layer, kspt, kstep, kinc)
!
      implicit none
      character*80 cmname
      integer leximp, lend, nstatv, noel, npt, layer, kspt, kstep, kinc
      double precision decra(5), deswa(5), statev(*), serd, ec(2)
      double precision esw(2), p, qtild, temp, dtemp, predef(*)
      double precision dpred(*), time(2), dtime, coords(*)
!
      double precision y($ny), slope($ny, 2), temps(2), finish, start
      double precision q, wanted, change, initial($ny), first($ny)
      integer pass
!
!     What may be edited: the total time TIME(2) at which the load was
!     first applied ($time), and what turns TEMP into kelvin.
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
!     1 $stress in MPa, and 1 $time in s
      double precision, parameter :: mpa = $mpa
      double precision, parameter :: seconds = $seconds
!
      finish = (time(2) - t_first)*seconds
      start = finish - dtime*seconds
      temps = temp + to_kelvin
$initial
      first = initial
$fetch!
!     Isotropic elasticity: the increment for a stress QTILD.
      if (lend .ne. 3) then
        y = first
        call ${id}_increment(start, finish, temps,
     &   max(qtild*mpa, 1.0d-30), 0.0d0, ec(1), y, slope)
        decra(1) = y(1)
        decra(5) = max(slope(1, 1)*mpa, 1.0d-90)
$store        return
      endif
!
!     Anisotropic elasticity: the stress for an increment DECRA(1), by
!     Newton's method in logarithms.
      wanted = max(decra(1), 1.0d-30)
      q = 100.0d0
      do pass = 1, 60
        y = first
        call ${id}_increment(start, finish, temps, q, 0.0d0,
     &   ec(1), y, slope)
        if (.not. y(1) > 0.0d0 .or. .not. slope(1, 1) > 0.0d0) then
          q = 10.0d0*q
          cycle
        endif
        change = log(wanted/y(1))*y(1)/(q*slope(1, 1))
        q = q*exp(max(min(change, 5.0d0), -5.0d0))
        if (abs(change) .lt. 1.0d-12) exit
      enddo
      qtild = q/mpa
      decra(5) = max(slope(1, 1)*mpa, 1.0d-90)
$store      return
      end
