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
      double precision y($ny), slope($ny, 2), outside(2, $no), given(2)
      double precision start, wanted, change, first($ny)
      integer pass
!
!     What may be edited: the total time TIME(2) at which the load was
!     first applied ($time), and what turns TEMP into kelvin.
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
      start = time(2) - t_first - dtime
      given(1) = qtild
      given(2) = 0.0d0
$outside      first = 0.0d0
$fetch!
!     Isotropic elasticity: the increment for a stress QTILD.
      if (lend .ne. 3) then
        y = first
        call ${id}_increment(start, dtime, outside, given, ec(1), y,
     &   slope)
        decra(1) = y(1)
        decra(5) = max(slope(1, 1), 1.0d-90)
$store        return
      endif
!
!     Anisotropic elasticity: the stress for an increment DECRA(1), by
!     Newton's method in logarithms.
      wanted = max(decra(1), 1.0d-30)
      given(1) = $typical
      do pass = 1, 60
        y = first
        call ${id}_increment(start, dtime, outside, given, ec(1), y,
     &   slope)
        if (.not. y(1) > 0.0d0 .or. .not. slope(1, 1) > 0.0d0) then
          given(1) = 10.0d0*given(1)
          cycle
        endif
        change = log(wanted/y(1))*y(1)/(given(1)*slope(1, 1))
        given(1) = given(1)*exp(max(min(change, 5.0d0), -5.0d0))
        if (abs(change) .lt. 1.0d-12) exit
      enddo
      qtild = given(1)
      decra(5) = max(slope(1, 1), 1.0d-90)
$store      end
