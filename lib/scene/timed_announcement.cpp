// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/timed_announcement.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"
#include "base/parse_json.h"
#include "scene/announcement_json.h"

namespace polyhull {
namespace {

using nlohmann::json;

/// Times beyond it could not be subtracted from each other.
constexpr std::int64_t latest = INT64_MAX / 4;

Error unusable(const std::string& what) {
  return Error(Error::Kind::bad_input, "A timed announcement cannot be used: {}.", what);
}

std::optional<std::int64_t> time_of(const json& root, const char* name) {
  const auto found = root.find(name);
  if (found == root.end()) return {};
  // Integers beyond 64 bits are read as floating point and refused here.
  if (!found->is_number_integer() ||
      (found->is_number_unsigned() && found->get<std::uint64_t>() > latest) ||
      found->get<std::int64_t>() < 0 || found->get<std::int64_t>() > latest)
    throw unusable(fmt::format("'{}' must be a whole number of nanoseconds from 0 on", name));
  return found->get<std::int64_t>();
}

void read_timecode(const json& root, TimedAnnouncement& timed) {
  const auto found = root.find("timecode");
  if (found == root.end()) return;
  const json rate = root.value("timecode_rate", json());
  const auto is_part = [](const json& value) {
    return value.is_number_integer() && value >= 1 && value <= 1'000'000;
  };
  if (!found->is_string()) throw unusable("'timecode' must be a text such as \"10:00:00:00\"");
  if (!rate.is_array() || rate.size() != 2 || !is_part(rate[0]) || !is_part(rate[1]))
    throw unusable("'timecode_rate' must tell the timecode's frames per second as in [25, 1]");
  timed.timecode = found->get<std::string>();
  timed.timecode_numerator = rate[0].get<int>();
  timed.timecode_denominator = rate[1].get<int>();
}

std::size_t bytes_of(const Announcement& announcement) {
  std::size_t bytes = sizeof(AnnouncementHistory::Entry) + announcement.scene.size() +
                      announcement.pose.nodes.size() + announcement.viewport.name.size() +
                      announcement.lights.size() * sizeof(Light);
  for (const Light& light : announcement.lights) bytes += light.name.size();
  return bytes;
}

}  // namespace

TimedAnnouncement parse_timed_announcement(std::string_view text) {
  TimedAnnouncement timed;
  const auto root = parse_json<json>(text, "announcement of the scene");
  timed.announcement = announcement_of(root);
  read_timecode(root, timed);
  timed.stream_time_ns = time_of(root, "stream_time_ns");
  timed.unix_time_ns = time_of(root, "unix_time_ns");
  return timed;
}

std::int64_t time_difference(std::int64_t a, std::int64_t b, std::int64_t period) {
  if (period == 0) return a - b;
  const std::int64_t ahead = ((a - b) % period + period) % period;
  return ahead < period / 2 ? ahead : ahead - period;
}

template <typename Which>
void AnnouncementHistory::erase(Which which) {
  std::erase_if(entries_, [&](const Entry& entry) {
    if (!which(entry)) return false;
    bytes_ -= entry.bytes;
    return true;
  });
}

void AnnouncementHistory::add(std::int64_t time, Announcement announcement) {
  if (last_after(time) > near) ++run_;
  erase([&](const Entry& entry) { return entry.time == time; });
  const std::size_t bytes = bytes_of(announcement);
  entries_.push_back({time, std::move(announcement), run_, bytes});
  bytes_ += bytes;
  while (entries_.size() > most || (bytes_ > most_bytes && entries_.size() > 1)) {
    bytes_ -= entries_.front().bytes;
    entries_.pop_front();
  }
}

void AnnouncementHistory::begin_again(std::int64_t time, std::uint64_t run) {
  if (run_ == run) ++run_;  // messages are yet to jump
  erase([&](const Entry& entry) { return entry.run < run_ && difference(entry.time, time) >= 0; });
}

const AnnouncementHistory::Entry* AnnouncementHistory::at(std::int64_t time) const {
  const Entry* best = nullptr;
  for (const Entry& entry : entries_) {
    if (difference(entry.time, time) > 0) continue;
    if (best == nullptr || difference(entry.time, best->time) > 0) best = &entry;
  }
  return best;
}

bool AnnouncementHistory::reaches(std::int64_t time) const {
  const auto later = [&](const Entry& entry) { return difference(entry.time, time) >= 0; };
  const auto next = [&](const Entry& entry) {
    return later(entry) && difference(entry.time, time) <= near;
  };
  return std::any_of(entries_.begin(), entries_.end(), next) ||
         (entries_.size() >= 2 && later(entries_.back()) && later(*std::next(entries_.rbegin())));
}

bool AnnouncementHistory::is_crowded(std::int64_t time) const {
  const Entry* held = at(time);
  std::size_t count = 0, bytes = 0;
  for (auto entry = entries_.rbegin(); entry != entries_.rend() && &*entry != held; ++entry) {
    ++count;
    bytes += entry->bytes;
  }
  return count > most / 2 || bytes > most_bytes / 2;
}

std::int64_t AnnouncementHistory::last_after(std::int64_t time) const {
  return entries_.empty() ? 0 : difference(entries_.back().time, time);
}

}  // namespace polyhull
