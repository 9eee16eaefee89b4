// The reverse of the law of contact (core/contact/law.h), by hand, over any scalar. With N = lambda_n, s = 1 - a n . u, L = mu N, e = tau/|tau| and P = I - n n^T,
//
//   slides:  mu' += (e . t') N,  N' += mu (e . t'),  tau' = L/|tau| (t' - (e . t') e)        sticks:  tau' = t', 0 where mu = 0
//   g' = P tau',  f' += g',  u' -= kappa g',  kappa' -= u . g',  n' -= (n . g) tau' + (n . tau') g         g = f - kappa u
//   kappa' -= gap s N',  gap' = -kappa s N',  s' = -kappa gap N'
//
// where t' and N' are the cotangents of lambda_t and lambda_n.
#pragma once

#include "core/contact/law.h"

namespace sheetbend {

template <class T>
struct LawCotangents {
  T gap{};
  Vec3<T> n, slip, carried;
  T friction{}, kappa{}, loss{};
};

template <class T>
LawCotangents<T> contact_force_vjp(const T& gap, const Vec3<T>& n, const Vec3<T>& slip, const Vec3<T>& carried,
                                   const T& friction, const T& kappa, const T* loss, const T& normal_bar,
                                   const Vec3<T>& tangential_bar) {
  const T zero(0.0), one(1.0);
  const Vec3<T> none(zero, zero, zero);
  const auto c = contact_force(gap, n, slip, carried, friction, kappa, loss);
  LawCotangents<T> bar;
  if (!any(c.pushes)) return bar;
  const Vec3<T> trial = carried - kappa * slip;
  const T along = dot(n, trial);
  const Vec3<T> tau = trial - along * n;
  const Vec3<T> t_bar = select(c.pushes, tangential_bar, none);
  const T inverse = one / sqrt(select(c.slides, dot(tau, tau), one));
  const Vec3<T> e = inverse * tau;
  const T limit_bar = select(c.slides, dot(e, t_bar), zero);
  const T limit = friction * c.normal;
  const Vec3<T> held_bar = select(limit > zero, t_bar, none);
  const Vec3<T> tau_bar = select(c.slides, (limit * inverse) * (t_bar - limit_bar * e), held_bar);
  const T across = dot(n, tau_bar);
  const Vec3<T> trial_bar = tau_bar - across * n;
  bar.friction = limit_bar * c.normal;
  bar.carried = trial_bar;
  bar.slip = -(kappa * trial_bar);
  bar.kappa = -dot(slip, trial_bar);
  bar.n = -(along * tau_bar + across * trial);
  T push_bar = select(c.pushes, normal_bar + friction * limit_bar, zero);
  if (loss) {
    const T share_bar = -(kappa * gap) * push_bar, away = dot(n, slip);
    push_bar = (one - *loss * away) * push_bar;
    bar.loss = -(share_bar * away);
    bar.n = bar.n - (share_bar * *loss) * slip;
    bar.slip = bar.slip - (share_bar * *loss) * n;
  }
  bar.gap = -(kappa * push_bar);
  bar.kappa -= gap * push_bar;
  return bar;
}

}  // namespace sheetbend
