// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/capture_clock.h"

#include <gst/video/video.h>

namespace polyhull::element {
namespace {

constexpr std::int64_t from_1900_to_1970 = 2'208'988'800'000'000'000;  // ns

struct KnownClock {
  const char* caps;
  CaptureClock clock;
  std::int64_t epoch;  // what is taken from its times, ns
};

constexpr KnownClock known_clocks[] = {
    {"timestamp/x-unix", CaptureClock::unix, 0},
    {"timestamp/x-ndi-timestamp", CaptureClock::unix, 0},
    {"timestamp/x-ntp", CaptureClock::unix, from_1900_to_1970},
    {"timestamp/x-ptp", CaptureClock::ptp, 0},
};

const KnownClock* find(const GstCaps* reference) {
  if (reference == nullptr || gst_caps_is_empty(reference) || gst_caps_is_any(reference))
    return nullptr;
  const char* name = gst_structure_get_name(gst_caps_get_structure(reference, 0));
  for (const KnownClock& entry : known_clocks)
    if (g_str_equal(name, entry.caps)) return &entry;
  return nullptr;
}

}  // namespace

void find_camera_time(GstBuffer* buffer, std::int64_t& time, CaptureClock& clock,
                      std::optional<CaptureClock> only) {
  gpointer state = nullptr;
  while (GstMeta* meta = gst_buffer_iterate_meta_filtered(buffer, &state,
                                                          GST_REFERENCE_TIMESTAMP_META_API_TYPE)) {
    const auto* stamp = reinterpret_cast<const GstReferenceTimestampMeta*>(meta);
    const KnownClock* entry = find(stamp->reference);
    if (entry == nullptr || (only && entry->clock != *only)) continue;
    const guint64 since = stamp->timestamp - static_cast<guint64>(entry->epoch);
    if (since > static_cast<guint64>(latest_time)) continue;  // or before the epoch
    time = static_cast<std::int64_t>(since);
    clock = entry->clock;
    return;
  }
}

std::int64_t timecode_of(GstBuffer* buffer) {
  GstVideoTimeCodeMeta* meta = gst_buffer_get_video_time_code_meta(buffer);
  if (meta == nullptr || !gst_video_time_code_is_valid(&meta->tc)) return no_time;
  return static_cast<std::int64_t>(gst_video_time_code_nsec_since_daily_jam(&meta->tc));
}

}  // namespace polyhull::element
