      subroutine umat(stress, statev, ddsdde, sse, spd, scd, rpl,
     & ddsddt, drplde, drpldt, stran, dstran, time, dtime, temp,
     & dtemp, predef, dpred, cmname, ndi, nshr, ntens, nstatv, props,
     & nprops, coords, drot, pnewdt, celent, dfgrd0, dfgrd1, noel, npt,
     & layer, kspt, kstep, kinc)
      implicit none
      character*80 cmname
      integer ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt
      integer kstep, kinc
      double precision stress(ntens), statev(nstatv), sse, spd, scd, rpl
      double precision ddsdde(ntens, ntens), ddsddt(ntens)
      double precision drplde(ntens), drpldt, stran(ntens), time(2)
      double precision dstran(ntens), dtime, temp, dtemp, predef(*)
      double precision dpred(*), props(*), coords(3), drot(3, 3)
      double precision pnewdt, celent, dfgrd0(3, 3), dfgrd1(3, 3)
!
!     What may be edited: the total time at which the load was first
!     applied ($time), and what turns TEMP into kelvin.
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
      double precision s(6), de(6), c(6, 6), y($ny), outside(2, $no)
      integer k, ${id}_update
      if (ndi .ne. 3 .or. nstatv .lt. $kept) then
        write(*, *) 'UMAT of creepkit: it takes three direct stresses',
     &   ' (solids, plane strain, axisymmetry) and *DEPVAR of $kept'
        stop 1
      endif
      s = 0.0d0
      de = 0.0d0
      s(1:ntens) = stress
      de(1:ntens) = dstran
      y = statev(1:$ny)
$outside      k = ${id}_update(time(2) - t_first, dtime, outside, de, s, y, c)
      if (k .ne. 0) then
        pnewdt = 0.25d0
        return
      endif
      stress = s(1:ntens)
      ddsdde = c(1:ntens, 1:ntens)
      statev(1:$ny) = y
$keep      end
