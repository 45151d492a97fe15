      subroutine usermat(matid, elemid, kdomintpt, klayer, ksectpt,
     & ldstep, isubst, keycut, ndirect, nshear, ncomp, nstatev, nprop,
     & time, dtime, temp, dtemp, stress, ustatev, dsdepl, sedel, sedpl,
     & epseq, strain, dstrain, epspl, prop, coords, var0, defgrad_t,
     & defgrad, tsstif, epszz, cutfactor, pvolder, hrmflg, var3, var4,
     & var5, var6, var7)
!DEC$$ ATTRIBUTES DLLEXPORT, ALIAS:"USERMAT"::usermat
      implicit none
      integer matid, elemid, kdomintpt, klayer, ksectpt, ldstep, isubst
      integer keycut, ndirect, nshear, ncomp, nstatev, nprop
      double precision time, dtime, temp, dtemp, stress(ncomp)
      double precision ustatev(nstatev), dsdepl(ncomp, ncomp), sedel
      double precision sedpl, epseq, strain(ncomp), dstrain(ncomp)
      double precision epspl(ncomp), prop(*), coords(3), var0
      double precision defgrad_t(3, 3), defgrad(3, 3), tsstif(2), epszz
      double precision cutfactor, pvolder(3), hrmflg, var3, var4, var5
      double precision var6, var7
!
!     What may be edited: the time at which the load was first applied
!     ($time), and what turns the temperature into kelvin.
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
!     Shear stresses come as 12, 23, 13; the update has 12, 13, 23.
      integer, parameter :: place(6) = (/ 1, 2, 3, 4, 6, 5 /)
      double precision s(6), de(6), c(6, 6), y($ny), outside(2, $no)
      integer k, ${id}_update
      if (ndirect .ne. 3 .or. nstatev .lt. $kept) then
        write(*, *) 'USERMAT of creepkit: it takes three direct ',
     &   'stresses (solids, plane strain, axisymmetry) and $kept states'
        stop 1
      endif
      s = 0.0d0
      de = 0.0d0
      s(place(1:ncomp)) = stress
      de(place(1:ncomp)) = dstrain
      y = ustatev(1:$ny)
      outside(1, 1) = temp + to_kelvin
      outside(2, 1) = temp + dtemp + to_kelvin
      k = ${id}_update(time - t_first, dtime, outside, de, s, y, c)
      keycut = k
      if (k .ne. 0) then
        cutfactor = 0.25d0
        return
      endif
      stress = s(place(1:ncomp))
      dsdepl = c(place(1:ncomp), place(1:ncomp))
      ustatev(1:$ny) = y
      epseq = y(1)
      tsstif = c(4, 4)
      end
