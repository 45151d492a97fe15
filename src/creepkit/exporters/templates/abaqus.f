      subroutine creep(decra, deswa, statev, serd, ec, esw, p, qtild,
     & temp, dtemp, predef, dpred, time, dtime, cmname, leximp, lend,
     & coords, nstatv, noel, npt, layer, kspt, kstep, kinc)
!
      include 'ABA_PARAM.INC'
!
      character*80 cmname
      dimension decra(5), deswa(5), statev(*), predef(*), dpred(*),
     & time(3), coords(*), ec(2), esw(2)
      double precision y($ny), slope($ny, 2), temps($nt), finish, start
      double precision initial($ny)
!
!     What may be edited: the clock, TIME(2) of all steps or TIME(3) of
!     those with creep; the time on it at which the load was first
!     applied ($time); and what turns TEMP into kelvin.
      integer, parameter :: clock = 2
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
!     1 $stress in MPa, and 1 $time in s
      double precision, parameter :: mpa = $mpa
      double precision, parameter :: seconds = $seconds
!
$initial
      decra = 0.0d0
      deswa = 0.0d0
      finish = (time(clock) - t_first)*seconds
      start = finish - dtime*seconds
      temps(1) = temp - dtemp + to_kelvin
      temps(2) = temp + to_kelvin
$fields      y = initial
$fetch      call ${id}_increment(start, finish, temps,
     & max(qtild*mpa, 1.0d-30), -p*mpa, ec(1), y, slope)
!
!     The strain at the end is part of the solution, so the increment
!     depends on EC(2) in no way: DECRA(2) is nil, and exactly so.
      decra(1) = y(1)
      decra(2) = 0.0d0
      decra(4) = -slope(1, 2)*mpa
      decra(5) = slope(1, 1)*mpa
$store      return
      end
