// SPDX-License-Identifier: LGPL-2.1-or-later
#include "run/clock_watch.h"

#include <gst/net/net.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "base/error.h"

using polyhull::Error;

namespace {

constexpr std::int64_t lost_after = 5'000'000;          // µs
constexpr std::int64_t same_clock_within = GST_SECOND;  // of who follows it well

[[noreturn]] void fail_other(const std::string& server, const std::string& how) {
  throw Error(
      Error::Kind::io,
      "The clock of {} is another one than it was ({}), as after a restart of its machine: "
      "by the one that this pipeline has followed its times would be wrong, or stand still. "
      "Start the pipeline again; where systemd does (Restart=always) it follows from here.",
      server, how);
}

}  // namespace

ClockWatch::ClockWatch(GstClock* clock, std::string server)
    : clock_(GST_CLOCK(gst_object_ref(clock))),
      server_(std::move(server)),
      heard_at_(g_get_monotonic_time()) {
  if (GST_IS_NET_CLIENT_CLOCK(clock)) {
    bus_ = gst_bus_new();
    g_object_set(clock, "bus", bus_, nullptr);
  } else if (GST_IS_PTP_CLOCK(clock)) {
    g_object_get(clock, "domain", &domain_, nullptr);
    ptp_ = gst_ptp_statistics_callback_add(hear_ptp, this, nullptr);
  }
}

ClockWatch::~ClockWatch() {
  if (bus_ != nullptr) {
    g_object_set(clock_, "bus", nullptr, nullptr);
    gst_object_unref(bus_);
  }
  if (ptp_ != 0) gst_ptp_statistics_callback_remove(ptp_);
  gst_object_unref(clock_);
}

gboolean ClockWatch::hear_ptp(guint8 domain, const GstStructure* stats, gpointer data) {
  auto& watch = *static_cast<ClockWatch*>(data);
  Observation heard;
  if (domain == watch.domain_ && gst_structure_has_name(stats, GST_PTP_STATISTICS_TIME_UPDATED) &&
      gst_structure_get_clock_time(stats, "local-time", &heard.local) &&
      gst_structure_get_clock_time(stats, "ptp-time", &heard.remote)) {
    const std::scoped_lock lock(watch.mutex_);
    watch.heard_ = heard;
  }
  return TRUE;
}

/// What has been heard of it last, since the last call.
std::optional<ClockWatch::Observation> ClockWatch::latest() {
  if (bus_ == nullptr) {
    const std::scoped_lock lock(mutex_);
    return std::exchange(heard_, std::nullopt);
  }
  std::optional<Observation> last;
  while (GstMessage* message = gst_bus_pop(bus_)) {
    const GstStructure* stats = gst_message_get_structure(message);
    Observation heard;
    if (stats != nullptr && gst_structure_has_name(stats, "gst-netclock-statistics") &&
        gst_structure_get_uint64(stats, "local", &heard.local) &&
        gst_structure_get_uint64(stats, "remote", &heard.remote))
      last = heard;
    gst_message_unref(message);
  }
  return last;
}

void ClockWatch::look() {
  if (bus_ == nullptr && ptp_ == 0) return;
  // Newer GStreamers take a network clock that has gone back for none, and tell nothing of it.
  g_autoptr(GstClock) internal = nullptr;
  g_object_get(clock_, "internal-clock", &internal, nullptr);
  if (bus_ != nullptr && internal != nullptr && !gst_clock_is_synced(internal))
    fail_other(server_, "it has gone back");
  const std::int64_t now = g_get_monotonic_time();
  const std::optional<Observation> heard = latest();
  if (!heard) {
    if (lost_ || now - heard_at_ < lost_after) return;
    lost_ = true;
    ++losses_;
    std::fprintf(stderr,
                 "\npolyhull-run: warning: nothing has come of the clock of %s for %lld s; this "
                 "machine's own goes on in its place and moves away from it. Look at that machine "
                 "and at the link.\n",
                 server_.c_str(), static_cast<long long>((now - heard_at_) / 1'000'000));
    return;
  }
  const auto time = static_cast<std::int64_t>(gst_clock_get_time(clock_));
  const auto passed = static_cast<std::int64_t>(1000 * g_get_monotonic_time()) -
                      static_cast<std::int64_t>(heard->local);
  const std::int64_t ahead = time - static_cast<std::int64_t>(heard->remote) - passed;
  if (lost_)
    std::fprintf(stderr, "\npolyhull-run: the clock of %s is there again, after %lld s\n",
                 server_.c_str(), static_cast<long long>((now - heard_at_) / 1'000'000));
  lost_ = false;
  heard_at_ = now;
  // One packet may have been held up, or be a stranger's.
  const bool was_wrong = std::exchange(wrong_, std::llabs(ahead) > same_clock_within);
  if (wrong_ && was_wrong)
    fail_other(server_,
               fmt::format("it is {:.1f} s {}", 1e-9 * static_cast<double>(std::llabs(ahead)),
                           ahead > 0 ? "behind" : "ahead"));
}
