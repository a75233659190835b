// SPDX-License-Identifier: LGPL-2.1-or-later
// What hullbuild's log says of instants: their views and who is waited for.
#include <algorithm>

#include "plugins/hullbuild/private.h"

namespace polyhull::element {
namespace {

std::string name_of_camera(GstAggregatorPad* pad) {
  const HullPadState& state = state_of<HullPadState>(pad);
  return state.name.empty() ? GST_OBJECT_NAME(pad) : state.name;
}

}  // namespace

std::string instant_text(const Pads& pads, const ViewDecision& set) {
  std::string views;
  for (const std::size_t i : set.heads) {
    const std::int64_t time = state_of<HullPadState>(pads[i]).head.time;
    views += (views.empty() ? "" : ", ") + name_of_camera(pads[i]);
    if (time != no_time && set.time != no_time)
      views += fmt::format(" +{} us", (time - set.time) / 1000);
  }
  return fmt::format("instant {} ({}){}", time_text(set.time), views,
                     set.trigger == no_trigger ? "" : fmt::format(", trigger {}", set.trigger));
}

std::string views_text(const Pads& pads, const std::vector<std::size_t>& which) {
  std::string text;
  for (const std::size_t i : which)
    text += fmt::format("{}{} at {}", text.empty() ? "" : ", ", name_of_camera(pads[i]),
                        time_text(state_of<HullPadState>(pads[i]).head.time));
  return text;
}

std::string waiting_text(const Pads& pads, const std::vector<ViewHead>& heads) {
  std::string text;
  for (std::size_t i = 0; i < heads.size(); ++i)
    if (heads[i].state == ViewHead::State::waiting)
      text += (text.empty() ? "" : ", ") + name_of_camera(pads[i]);
  return text;
}

}  // namespace polyhull::element
