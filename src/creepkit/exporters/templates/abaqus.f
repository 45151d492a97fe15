      subroutine creep(decra, deswa, statev, serd, ec, esw, p, qtild,
     & temp, dtemp, predef, dpred, time, dtime, cmname, leximp, lend,
     & coords, nstatv, noel, npt, layer, kspt, kstep, kinc)
!
      include 'ABA_PARAM.INC'
!
      character*80 cmname
      dimension decra(5), deswa(5), statev(*), predef(*), dpred(*),
     & time(3), coords(*), ec(2), esw(2)
      double precision y($ny), slope($ny, 2), outside(2, $no), given(2)
      double precision start
!
!     What may be edited: the clock, TIME(2) of all steps or TIME(3) of
!     those with creep; the time on it at which the load was first
!     applied ($time); and what turns TEMP into kelvin.
      integer, parameter :: clock = 2
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
      decra = 0.0d0
      deswa = 0.0d0
      start = time(clock) - t_first - dtime
      given(1) = qtild
      given(2) = -p
$outside      y(2:) = statev(1:$ns)
      call ${id}_increment(start, dtime, outside, given, ec(1), y, slope)
!
!     The strain at the end is part of the solution, so the increment
!     depends on EC(2) in no way: DECRA(2) is nil, and exactly so.
      decra(1) = y(1)
      decra(4) = -slope(1, 2)
      decra(5) = slope(1, 1)
      statev(1:$ns) = y(2:)
      end
