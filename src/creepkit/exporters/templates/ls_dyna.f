      subroutine umat43(cm, eps, sig, epsp, hsv, dt1, capa, etype, tt,
     & temper, failel, crv, nnpcrv, cma, qmat, elsiz, idele, reject)
      implicit none
      double precision cm(*), eps(6), sig(6), epsp, hsv(*), dt1, capa
      double precision tt, temper, crv(*), cma(*), qmat(3, 3), elsiz
      integer nnpcrv(*), idele
      logical failel, reject
      character*5 etype
!
!     What may be edited: the time at which the load was first applied
!     ($time), and what turns the temperature into kelvin.
      double precision, parameter :: t_first = 0.0d0
      double precision, parameter :: to_kelvin = 0.0d0
!
!     Shear stresses come as xy, yz, zx; the update has 12, 13, 23.
      integer, parameter :: place(6) = (/ 1, 2, 3, 4, 6, 5 /)
      double precision s(6), de(6), c(6, 6), y($ny), outside(2, $no)
      integer k, ${id}_update
      if (etype .eq. 'shell' .or. etype .eq. 'beam ') then
        write(*, *) 'UMAT of creepkit: it takes solid elements alone'
        stop 1
      endif
      s(place) = sig(1:6)
      de(place) = eps(1:6)
      y = hsv(1:$ny)
      outside(2, 1) = temper + to_kelvin
      outside(1, 1) = outside(2, 1)
      if (hsv($kept) .gt. 0.0d0) outside(1, 1) = hsv($kept)
      k = ${id}_update(tt - dt1 - t_first, dt1, outside, de, s, y, c)
      reject = k .ne. 0
      if (reject) return
      sig(1:6) = s(place)
      hsv(1:$ny) = y
      hsv($kept) = outside(2, 1)
      hsv($kept + 1:$kept + 36) = reshape(c(place, place), (/ 36 /))
      epsp = y(1)
      end
!
! The tangent of the latest update, which umat43 has kept: history and
! stress come here as the latest call of umat43 has left them.
!
      subroutine utan43(cm, eps, sig, epsp, hsv, dt1, unsym, capa,
     & etype, tt, temper, es, crv, nnpcrv, failel, cma, qmat)
      implicit none
      double precision cm(*), eps(6), sig(6), epsp, hsv(*), dt1, capa
      double precision tt, temper, es(6, 6), crv(*), cma(*), qmat(3, 3)
      integer nnpcrv(*)
      logical failel, unsym
      character*5 etype
      es = reshape(hsv($kept + 1:$kept + 36), (/ 6, 6 /))
      end
