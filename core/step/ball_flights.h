// The flights of a scene's balls in a substep. Their impacts, with each other and with colliders, happen in the order of time: after each, those that it
// changes are looked for anew, among balls whose ways may cross. At the same instant the order is that of balls. What is found and in which order are values,
// of which nothing is differentiated.
#pragma once

#include <algorithm>
#include <functional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/contact/box_grid.h"
#include "core/step/flights.h"

namespace sheetbend {

template <class T>
class BallFlights {
 public:
  using S = Single<T>;

  // Lets them fly to the end of a substep: adds their impacts, and writes where those that have bounced fly to. Memory is kept for the next substep.
  void fly(const ContactSource<T>& source, const Plan& plan, const ColliderPoses<S>& poses, const Coordinates<T>& q,
           std::vector<Impact<S>>& impacts) {
    plan_ = &plan;
    begin(source, poses, q);
    for (int i = 0; i < count(); ++i) {
      look_for_surfaces(i);
      for (const int j : ways_.around(way_of(flying_[i].values)))
        if (j > i) look_for_meeting(i, j);
    }
    while (!next_.empty()) {
      std::pop_heap(next_.begin(), next_.end(), std::greater<>());
      const Event event = next_.back();
      next_.pop_back();
      if (is_over(event)) continue;
      if (event.other < 0 && event.rests) {
        std::erase(flying_[event.one].contacts, event.contact);  // left to the projection
        look_for_surfaces(event.one);
        continue;
      }
      impacts.push_back(event.other < 0 ? bounce(event) : hit(event));
      look_from(event.one, -1);
      if (event.other >= 0) look_from(event.other, event.one);
    }
    for (int i = 0; i < count(); ++i)
      if (flying_[i].impacts > 0) source.write(flying_[i].ball.flight.x_end, q.of(balls().members[i].node));
  }

 private:
  struct Flying {
    Ball<S> ball;
    Ball<double> values;
    std::vector<int> contacts;  // off which it may bounce
    int impacts;
    int rests_with;  // the ball that its last impact was with, too slow to bounce; -1 where there is none
  };

  struct Event {
    double when;  // since the start of the substep
    int one, other;
    int contact;  // -1 where two balls meet, as `other` is where one bounces
    double time;
    bool dated, rests;
    int impacts_of_one = 0, impacts_of_other = 0;  // as it was found

    bool operator>(const Event& e) const {
      return std::tie(when, one, other, contact) > std::tie(e.when, e.one, e.other, e.contact);
    }
  };

  const Balls& balls() const { return source_->scene.balls; }
  int count() const { return static_cast<int>(flying_.size()); }

  void begin(const ContactSource<T>& source, const ColliderPoses<S>& poses, const Coordinates<T>& q) {
    source_ = &source, poses_ = &poses;
    boxes_.clear(), next_.clear();
    if (flying_.empty()) find_surfaces();
    flying_.resize(balls().members.size());
    for (int ball = 0; ball < count(); ++ball) {
      const Bouncer& own = balls().members[ball];
      Flying& f = flying_[ball];
      f.ball = ball_of(source, ball, flight_of(source, own.node, source.read(Vec3<T>(q.of(own.node)))));
      f.contacts = own.contacts;
      f.impacts = 0, f.rests_with = -1;
      take_values(f);
      boxes_.push_back(way_of(f.values));
    }
    ways_.reset(boxes_);
    for (auto& [contact, surface] : surfaces_) surface = as_values(source.surface(poses, contact));
  }

  static void take_values(Flying& f) {
    f.values = {as_values(f.ball.flight), value_of(f.ball.radius), value_of(f.ball.mass)};
  }

  // Where a ball on its way from the start of its flight on is, and a bit more.
  static Box way_of(const Ball<double>& ball) {
    const Flight<double>& path = ball.flight;
    const double reach = ball.radius + 0.125 * path.left * norm(path.v_end - path.v);
    const double a[3] = {path.x.x, path.x.y, path.x.z}, b[3] = {path.x_end.x, path.x_end.y, path.x_end.z};
    Box box;
    for (int d = 0; d < 3; ++d) box.low[d] = std::min(a[d], b[d]) - reach, box.high[d] = std::max(a[d], b[d]) + reach;
    return box;
  }

  void add(Event event) {
    event.impacts_of_one = flying_[event.one].impacts;
    if (event.other >= 0) event.impacts_of_other = flying_[event.other].impacts;
    next_.push_back(event);
    std::push_heap(next_.begin(), next_.end(), std::greater<>());
  }

  // Whether one of both has flown elsewhere since.
  bool is_over(const Event& e) const {
    return flying_[e.one].impacts != e.impacts_of_one ||
           (e.other >= 0 && flying_[e.other].impacts != e.impacts_of_other);
  }

  // What a ball may hit after an impact.
  void look_from(int i, int but) {
    look_for_surfaces(i);
    for (const int j : ways_.around(way_of(flying_[i].values)))
      if (j != i && j != but) look_for_meeting(std::min(i, j), std::max(i, j));
  }

  // With which collider a ball meets next.
  void look_for_surfaces(int i) {
    const Flying& f = flying_[i];
    if (f.impacts >= most_impacts) return;
    const Flight<double>& path = f.values.flight;
    Event event{0.0, i, -1, -1, 0.0, true, false};
    for (const int contact : f.contacts) {
      const ImpactRule own = rule_of(*source_, contact);
      const Surface<double>& surface = surface_of(contact);
      if (!meets(own, path, surface)) continue;
      const double time = time_of_impact(own, path, surface, 0.0, path.left);
      if (event.contact < 0 || time < event.time) event.contact = contact, event.time = time;
    }
    if (event.contact < 0) return;
    event.when = source_->h - path.left + event.time;
    event.rests = !bounces(rule_of(*source_, event.contact), path, surface_of(event.contact), event.time);
    add(event);
  }

  void look_for_meeting(int i, int j) {
    const Flying &one = flying_[i], &other = flying_[j];
    if (one.impacts >= most_impacts || other.impacts >= most_impacts) return;
    if (one.rests_with == j) return;
    const double e = value_of(source_->read(source_->in.of(Quantity::restitution)[balls().restitution]));
    const auto found = meeting_of(rule_of_balls(*source_), {one.values, other.values, e});
    if (!found) return;
    const double from = source_->h - std::min(one.values.flight.left, other.values.flight.left);
    add({from + found->time, i, j, -1, found->time, found->dated, found->rests});
  }

  Impact<S> bounce(const Event& event) {
    Flying& f = flying_[event.one];
    const Flight<S> before = f.ball.flight;
    f.ball.flight =
        bounced(rule_of(*source_, event.contact), before, source_->surface(*poses_, event.contact), event.time);
    return {source_->lane, event.contact, {event.time, true, false}, {flown(event.one, before)}};
  }

  Impact<S> hit(const Event& event) {
    Flying &one = flying_[event.one], &other = flying_[event.other];
    const BallMeeting meeting{event.time, event.dated, event.rests};
    const BallPair<S> before = pair_of(*source_, *plan_, event.one, event.other, one.ball.flight, other.ball.flight);
    const auto after = collided(rule_of_balls(*source_), before, meeting);
    one.ball.flight = after[0], other.ball.flight = after[1];
    const Flown<S> first = flown(event.one, before.one.flight), second = flown(event.other, before.other.flight);
    if (event.rests) one.rests_with = event.other, other.rests_with = event.one;
    return {source_->lane, -1, meeting, {first, second}};
  }

  Flown<S> flown(int i, const Flight<S>& before) {
    Flying& f = flying_[i];
    ++f.impacts;
    if (f.rests_with >= 0) flying_[f.rests_with].rests_with = -1;
    f.rests_with = -1;
    take_values(f);
    ways_.move(i, way_of(f.values));
    return {balls().members[i].node, i, before, f.ball.flight};
  }

  // Which contacts they may bounce off.
  void find_surfaces() {
    std::set<int> all;
    for (const Bouncer& own : balls().members) all.insert(own.contacts.begin(), own.contacts.end());
    for (const int contact : all) surfaces_.emplace_back(contact, Surface<double>());
  }
  const Surface<double>& surface_of(int contact) const {
    return std::find_if(surfaces_.begin(), surfaces_.end(), [&](const auto& s) { return s.first == contact; })->second;
  }

  const ContactSource<T>* source_ = nullptr;  // of the substep, as the next
  const Plan* plan_ = nullptr;
  const ColliderPoses<S>* poses_ = nullptr;
  std::vector<Flying> flying_;
  std::vector<std::pair<int, Surface<double>>> surfaces_;
  std::vector<Box> boxes_;
  BoxGrid ways_;
  std::vector<Event> next_;  // a heap, the earliest first; some of which are over
};

}  // namespace sheetbend
