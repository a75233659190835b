// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/view_sets.h"

#include <algorithm>
#include <limits>

namespace polyhull {
namespace {

using State = ViewHead::State;
using Kind = ViewDecision::Kind;

template <class Condition>
std::vector<std::size_t> where(std::span<const ViewHead> heads, Condition condition) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < heads.size(); ++i)
    if (condition(heads[i])) result.push_back(i);
  return result;
}

bool is_view(const ViewHead& head) {
  return head.state == State::view;
}

}  // namespace

// Numbers that fall while time goes on.
bool ViewSets::restarted(const ViewHead& head, std::int64_t tolerance) const {
  return head.trigger != no_trigger && last_trigger_ != no_trigger &&
         head.trigger <= last_trigger_ && head.time != no_time && last_time_ != no_time &&
         head.time > last_time_ + tolerance;
}

bool ViewSets::late(const ViewHead& head, std::int64_t tolerance) const {
  if (head.trigger != no_trigger && last_trigger_ != no_trigger)
    return head.trigger <= last_trigger_ && !restarted(head, tolerance);
  return head.time != no_time && last_time_ != no_time && head.time <= last_time_ + tolerance;
}

std::vector<std::size_t> ViewSets::members(std::span<const ViewHead> heads,
                                           std::int64_t tolerance) const {
  bool by_trigger = true, by_time = true;
  const ViewHead* first = nullptr;
  const ViewHead* earliest = nullptr;
  for (const ViewHead& head : heads) {
    if (!is_view(head)) continue;
    by_trigger = by_trigger && head.trigger != no_trigger && !restarted(head, tolerance);
    by_time = by_time && head.time != no_time;
    if (!first || head.trigger < first->trigger) first = &head;
    if (!earliest || head.time < earliest->time) earliest = &head;
  }
  if (by_trigger)
    return where(heads,
                 [&](const ViewHead& h) { return is_view(h) && h.trigger == first->trigger; });
  if (!by_time) return where(heads, is_view);  // nothing to go by but the order of arrival
  return where(heads, [&](const ViewHead& h) {
    const bool numbers_agree = h.trigger == no_trigger || earliest->trigger == no_trigger ||
                               h.trigger == earliest->trigger;
    return is_view(h) && numbers_agree && h.time <= earliest->time + tolerance;
  });
}

ViewDecision ViewSets::next(std::span<const ViewHead> heads, std::int64_t tolerance,
                            bool deadline_passed) {
  const auto stale = [&](const ViewHead& h) { return is_view(h) && late(h, tolerance); };
  auto dropped = where(heads, [&](const ViewHead& h) { return stale(h) && h.repeated; });
  if (!dropped.empty()) return {Kind::drop_duplicate, dropped, no_time, no_trigger};
  dropped = where(heads, stale);
  if (!dropped.empty()) return {Kind::drop_late, dropped, no_time, no_trigger};

  ViewDecision set{Kind::set, members(heads, tolerance), no_time, no_trigger};
  for (const std::size_t i : set.heads) {
    if (heads[i].time != no_time)
      set.time = set.time == no_time ? heads[i].time : std::min(set.time, heads[i].time);
    if (set.trigger == no_trigger) set.trigger = heads[i].trigger;
  }
  const auto in_state = [](State state) {
    return [state](const ViewHead& h) { return h.state == state; };
  };
  const bool waiting = std::any_of(heads.begin(), heads.end(), in_state(State::waiting));
  // A gap that ends before the set says nothing about it. Where there are only gaps the first to
  // end goes, one without times, which tells nothing, at once: the others still speak for their
  // cameras when that one's views come, and without them those would wait for cameras that have
  // nothing to send.
  constexpr std::int64_t end_of_time = std::numeric_limits<std::int64_t>::max();
  static_assert(no_time < 0);
  std::int64_t over = set.time == no_time ? end_of_time : set.time;
  if (set.heads.empty()) {
    const auto untimed = where(
        heads, [](const ViewHead& h) { return h.state == State::gap && h.gap_end == no_time; });
    if (!untimed.empty()) return {Kind::drop_gaps, untimed, no_time, no_trigger};
    if (waiting && !deadline_passed) return {Kind::wait, {}, no_time, no_trigger};
    for (const ViewHead& h : heads)
      if (h.state == State::gap) over = std::min(over, h.gap_end);
  }
  const auto gaps =
      where(heads, [&](const ViewHead& h) { return h.state == State::gap && h.gap_end <= over; });
  if (!gaps.empty()) return {Kind::drop_gaps, gaps, no_time, no_trigger};
  if (set.heads.empty()) {
    const bool ended =
        !heads.empty() && std::all_of(heads.begin(), heads.end(), in_state(State::ended));
    return {ended ? Kind::end : Kind::wait, {}, no_time, no_trigger};
  }
  if (waiting && !deadline_passed) return {Kind::wait, {}, no_time, no_trigger};
  last_trigger_ = set.trigger;
  if (set.time != no_time) last_time_ = set.time;
  return set;
}

}  // namespace polyhull
