// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "plugins/hullbuild/private.h"

namespace polyhull::element {
namespace {

constexpr std::int64_t start_time = GST_SECOND;
/// A live pad that has brought nothing for so long may be stood in for by another.
constexpr std::int64_t silent_time = GST_SECOND;

ViewHead head_of_gap(const Arrival& gap) {
  ViewHead head;
  head.state = ViewHead::State::gap;
  head.time = gap.time();
  head.gap_end = gap.end();
  return head;
}

ViewHead head_of_view(const HullPadState& state) {
  ViewHead head;
  head.state = ViewHead::State::view;
  head.trigger = state.view->view().trigger;
  head.time = state.parsed.time();
  head.repeated = head.trigger != no_trigger ? head.trigger == state.last_trigger
                                             : head.time != no_time && head.time == state.last_time;
  return head;
}

/// The view, or what is none, at the front of \p pad is left out, which is said.
void drop_unusable(HullBuild& self, GstAggregatorPad* pad, const Error& why) {
  HullPadState& state = state_of<HullPadState>(pad);
  state.forget_front();
  pop(pad);
  ++state.unusable;
  self.statistics.warn(
      GST_ELEMENT_CAST(self.element), "views-unusable",
      fmt::format("A buffer on {} was dropped: {}", GST_OBJECT_NAME(pad), why.what()));
}

/// Whether \p other is who brings the camera \p name, and would still at \p time (running time, ns).
bool owns(const HullPadState& other, const std::string& name, std::int64_t time) {
  if (other.name != name || other.brought != name || other.ended) return false;
  return other.view != nullptr || time == no_time || other.brought_at == no_time ||
         time - other.brought_at < silent_time;
}

/// Throws Error unless the view at the front of the pad \p at is of a camera of the rig, of its size,
/// and no other pad's.
void check_front(HullBuild& self, const Pads& pads, std::size_t at) {
  GstAggregatorPad* pad = pads[at];
  HullPadState& state = state_of<HullPadState>(pad);
  const View& view = state.view->view();
  const std::string& name = state.brought;
  const std::string where = std::string("hullbuild's pad ") + GST_OBJECT_NAME(pad);
  if (name.empty())
    throw Error(Error::Kind::bad_input,
                "{} has no camera: neither its property camera nor its views name one. Set "
                "camera=NAME on contourfind or {}::camera=NAME here.",
                where, GST_OBJECT_NAME(pad));
  for (std::size_t i = 0; i < pads.size(); ++i) {
    if (i == at) continue;
    const HullPadState& other = state_of<HullPadState>(pads[i]);
    const bool before = i < at && other.view != nullptr && other.brought == name;
    if (before || (self.live && owns(other, name, state.head.time)))
      throw Error(Error::Kind::bad_input,
                  "{} and {} both bring views of camera '{}'. Each pad takes another camera.",
                  where, GST_OBJECT_NAME(pads[i]), name);
  }
  self.stage.check(where, name, view.width, view.height);
  if (state.name == name) return;
  GST_DEBUG_OBJECT(pad, "camera %s joins with the view of %" GST_TIME_FORMAT, name.c_str(),
                   GST_TIME_ARGS(clock_time(state.head.time)));
  const ObjectLock lock(pad);
  state.name = name;
}

}  // namespace

std::string name_of(GstAggregatorPad* pad, const View& view) {
  std::string name = camera_property(pad);
  return name.empty() ? view.camera : name;
}

ViewHead look_at(HullBuild& self, GstAggregatorPad* pad) {
  HullPadState& state = state_of<HullPadState>(pad);
  for (;;) {
    const Arrival* front = peek(pad);
    const bool ended = front == nullptr && gst_aggregator_pad_is_eos(pad);
    if (std::exchange(state.ended, ended) != ended)
      GST_DEBUG_OBJECT(pad, "camera %s %s", state.name.c_str(), ended ? "has ended" : "goes on");
    if (front == nullptr) {
      state.forget_front();
      ViewHead head;
      if (state.ended) head.state = ViewHead::State::ended;
      return head;
    }
    if (front->buffer == state.parsed.buffer) return state.head;
    state.forget_front();
    const Arrival arrival = *front;
    try {
      if (!arrival.gap()) state.view = std::make_unique<ViewBuffer>(arrival.buffer);
    } catch (const Error& error) {
      drop_unusable(self, pad, error);
      continue;
    }
    state.parsed = arrival;
    gst_buffer_ref(arrival.buffer);
    state.head = state.view ? head_of_view(state) : head_of_gap(arrival);
    return state.head;
  }
}

void drop_fronts(const Pads& pads, const std::vector<std::size_t>& which) {
  for (const std::size_t i : which) {
    state_of<HullPadState>(pads[i]).forget_front();
    pop(pads[i]);
  }
}

bool check_cameras(HullBuild& self, const Pads& pads) {
  for (GstAggregatorPad* pad : pads) {
    HullPadState& state = state_of<HullPadState>(pad);
    if (state.view == nullptr) continue;
    state.brought = name_of(pad, state.view->view());
    state.brought_at = state.head.time;
  }
  bool good = true;
  for (std::size_t i = 0; i < pads.size(); ++i) {
    HullPadState& state = state_of<HullPadState>(pads[i]);
    if (state.view == nullptr) continue;
    try {
      check_front(self, pads, i);
    } catch (const Error& error) {
      // What one live camera does must not end the others' show.
      if (!self.live) throw;
      drop_unusable(self, pads[i], error);
      good = false;
    }
  }
  return good;
}

std::int64_t next_deadline(HullBuild& self, const Pads& pads) {
  if (pads.size() == 0) return no_time;
  std::int64_t view = no_time, gap = no_time;
  bool all = true, new_camera = false;
  for (GstAggregatorPad* pad : pads) {
    if (state_of<LivePadState>(pad).flushed) return 0;
    const Arrival* front = peek(pad);
    if (front == nullptr) {
      const bool ended = gst_aggregator_pad_is_eos(pad);
      all = all && ended;
      new_camera = new_camera || (!ended && state_of<HullPadState>(pad).last_time == no_time);
      continue;
    }
    // A gap is waited for to its end: up to there it speaks for its camera.
    std::int64_t& earliest = front->gap() ? gap : view;
    const std::int64_t time = front->gap() ? front->end() : front->time();
    if (time != no_time && (earliest == no_time || time < earliest)) earliest = time;
  }
  if (all) return 0;
  if (self.timing.now() == no_time) return no_time;
  const std::int64_t earliest = view != no_time ? view : gap;
  // A fade does not stay half way for longer than a picture that stands still is right.
  if (earliest == no_time)
    return self.fade.half_way() ? self.fade.time() + Fade::still + self.timing.wait() : no_time;
  // In the first second cameras are still coming up, and nothing is known of them.
  const bool starting = new_camera && view != no_time &&
                        (self.first_time == no_time || earliest - self.first_time < start_time);
  return earliest +
         (starting ? std::max(self.timing.wait(), self.start_wait.load()) : self.timing.wait());
}

}  // namespace polyhull::element
