// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/error.h"
#include "hullbuild_private.h"

namespace polyhull::element {
namespace {

ViewHead head_of_gap(GstAggregatorPad* pad, GstBuffer* buffer) {
  ViewHead head;
  head.state = ViewHead::State::gap;
  const GstClockTime begin = GST_BUFFER_PTS(buffer);
  const GstClockTime length = GST_BUFFER_DURATION(buffer);
  head.time = running_time(pad, begin);
  head.gap_end = GST_CLOCK_TIME_IS_VALID(begin) && GST_CLOCK_TIME_IS_VALID(length)
                     ? running_time(pad, begin + length)
                     : head.time;
  return head;
}

ViewHead head_of_view(GstAggregatorPad* pad, GstBuffer* buffer) {
  HullPadState& state = state_of(pad);
  ViewHead head;
  head.state = ViewHead::State::view;
  head.trigger = state.view->view().trigger;
  head.time = running_time(
      pad, GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer));
  head.repeated = head.trigger != no_trigger ? head.trigger == state.last_trigger
                                             : head.time != no_time && head.time == state.last_time;
  return head;
}

}  // namespace

bool is_gap(GstBuffer* buffer) {
  return GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_GAP) && gst_buffer_get_size(buffer) == 0;
}

std::string name_of(GstAggregatorPad* pad, const View& view) {
  std::string name = camera_property(pad);
  return name.empty() ? view.camera : name;
}

ViewHead look_at(PolyhullHullBuild* self, GstAggregatorPad* pad) {
  HullPadState& state = state_of(pad);
  for (;;) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
    if (buffer == nullptr) {
      state.forget_front();
      ViewHead head;
      if (gst_aggregator_pad_is_eos(pad)) head.state = ViewHead::State::ended;
      return head;
    }
    if (buffer == state.parsed) {
      gst_buffer_unref(buffer);
      return state.head;
    }
    state.forget_front();
    if (is_gap(buffer)) {
      state.head = head_of_gap(pad, buffer);
      state.parsed = buffer;
      return state.head;
    }
    try {
      state.view = std::make_unique<ViewBuffer>(buffer);
      state.head = head_of_view(pad, buffer);
      state.parsed = buffer;
      return state.head;
    } catch (const Error& error) {
      gst_buffer_unref(buffer);
      gst_aggregator_pad_drop_buffer(pad);
      self->priv->statistics.warn(
          GST_ELEMENT_CAST(self), "views-unusable",
          std::string("A buffer on ") + GST_OBJECT_NAME(pad) + " was dropped: " + error.what());
    }
  }
}

void drop_fronts(const Pads& pads, const std::vector<std::size_t>& which) {
  for (const std::size_t i : which) {
    state_of(pads[i]).forget_front();
    gst_aggregator_pad_drop_buffer(pads[i]);
  }
}

void check_cameras(PolyhullHullBuild* self, const Pads& pads) {
  std::vector<std::pair<std::string, const char*>> seen;
  for (GstAggregatorPad* pad : pads) {
    const HullPadState& state = state_of(pad);
    if (state.view == nullptr) continue;
    const View& view = state.view->view();
    const std::string name = name_of(pad, view);
    const std::string where = std::string("hullbuild's pad ") + GST_OBJECT_NAME(pad);
    if (name.empty())
      throw Error(Error::Kind::bad_input,
                  where +
                      " has no camera: neither its property camera nor its views name one. Set "
                      "camera=NAME on contourfind or " +
                      GST_OBJECT_NAME(pad) + "::camera=NAME here");
    for (const auto& [other, other_pad] : seen)
      if (other == name)
        throw Error(Error::Kind::bad_input, where + " and " + other_pad +
                                                " both bring views of camera \"" + name +
                                                "\". Each pad takes another camera");
    seen.emplace_back(name, GST_OBJECT_NAME(pad));
    self->priv->stage.check(where, name, view.width, view.height);
  }
}

std::int64_t earliest_time(gpointer element) {
  std::int64_t view = no_time, gap = no_time;
  for (GstAggregatorPad* pad : Pads(element)) {
    GstBuffer* buffer = gst_aggregator_pad_peek_buffer(pad);
    if (buffer == nullptr) continue;
    // A gap is waited for to its end: up to there it speaks for its camera.
    std::int64_t& earliest = is_gap(buffer) ? gap : view;
    const std::int64_t time = is_gap(buffer) ? head_of_gap(pad, buffer).gap_end
                                             : running_time(pad, GST_BUFFER_DTS_OR_PTS(buffer));
    gst_buffer_unref(buffer);
    if (time != no_time && (earliest == no_time || time < earliest)) earliest = time;
  }
  return view != no_time ? view : gap;
}

}  // namespace polyhull::element
