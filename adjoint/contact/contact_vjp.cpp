#include "adjoint/contact/collision_vjp.h"
#include "adjoint/contact/impact_vjp.h"
#include "adjoint/contact/rebound_vjp.h"
#include "adjoint/contact/touch_vjp.h"

namespace sheetbend {

template Vec3<double> touch_vjp(const AnyShape&, const Vec3<double>&, const ContactNumbers<double>&,
                                const Vec3<double>&, const Vec3<double>&, ContactNumbers<double>&);
template Vec3<double> normal_vjp(const AnyShape&, const Vec3<double>&, const double*, const Vec3<double>&, double*);
template Falling<double> rebound_vjp(const AnyShape&, double, bool, const Falling<double>&, const Rebound<double>&);
template Flight<double> bounced_vjp(const ImpactRule&, const Flight<double>&, const Surface<double>&, double,
                                    const Flight<double>&, Surface<double>&);
template BallPair<double> collided_vjp(const ImpactRule&, const BallPair<double>&, const BallMeeting&,
                                       const std::array<Flight<double>, 2>&);

}  // namespace sheetbend
