// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a timed announcement, and what is one goes through JSON unchanged.
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "base/error.h"
#include "scene/timed_announcement.h"

using namespace polyhull;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const TimedAnnouncement timed =
        parse_timed_announcement({reinterpret_cast<const char*>(data), size});
    const Announcement& read = timed.announcement;
    if (!std::isfinite(glm::length(read.viewport.centre())) || read.viewport.width < 1)
      std::abort();
    const Announcement again = parse_announcement(announcement_to_json(read));
    if (!(again.viewport.R == read.viewport.R && again.lights.size() == read.lights.size()))
      std::abort();
    AnnouncementHistory history(1000);
    history.add(timed.stream_time_ns.value_or(0), read);
    if (history.at(timed.stream_time_ns.value_or(0)) == nullptr) std::abort();
  } catch (const Error&) {
  }
  return 0;
}
