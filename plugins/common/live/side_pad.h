// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A sink pad beside the one that frames come in at: what comes there (a camera's poses, messages, a
/// second video) belongs to certain frames and goes no further by itself.
#pragma once

#include <gst/gst.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>

#include "plugins/common/memory/mapped_memory.h"

namespace polyhull::element {

/// The pad's streaming thread puts away what comes, and waits where it is far ahead of the frames,
/// unless it comes live; the element's thread waits with each frame for what belongs to it. A derived
/// class says what is put away.
class SidePad {
 public:
  SidePad(const SidePad&) = delete;

  /// A new pad, called as its template, which the caller adds to the element; null where there is
  /// one already.
  GstPad* make_pad(GstPadTemplate* pad_template);
  /// The element has removed the pad.
  void forget_pad();
  /// A reference on the pad; null where there is none, or nothing is linked to it.
  GstPad* linked_pad() const;
  bool linked() const;

  /// Ends waiting, now and from now on, until it is allowed again.
  void unlock(bool unlocked);
  bool unlocked() const;
  /// Passes an event that goes upstream on to what is linked to the pad; takes the reference. Whether
  /// somebody took it.
  bool push_upstream(GstEvent* event);

 protected:
  using Lock = std::unique_lock<std::mutex>;

  SidePad();
  ~SidePad() = default;

  // On the pad's thread, without the lock:
  virtual GstFlowReturn take(Ref<GstBuffer> buffer) = 0;
  /// A stream begins; the pad's thread is not in take().
  virtual void begin() {}
  /// Its last buffer has been taken.
  virtual void end() {}
  /// Whether \p caps can be lived with.
  virtual bool hear_caps(GstCaps*) { return true; }
  // With the lock:
  /// What has come holds no more.
  virtual void forget() = 0;

  /// Whether nothing more comes that could be waited for.
  bool over() const { return flushing_ || unlocked_ || ended_; }
  /// The element's thread waits until \p known or over(), at most \p longest ns; without: as long as
  /// it takes what does not come live, and not at all for what does.
  template <typename Known>
  void wait(Lock& lock, std::optional<std::int64_t> longest, Known known);
  /// The pad's thread waits as long as \p ahead of the frames, unless it comes live.
  template <typename Ahead>
  GstFlowReturn hold(Lock& lock, Ahead ahead);
  /// Running time of \p buffer, ns, below 0 before the segment's begin; none where it has none.
  std::optional<std::int64_t> running_time(GstBuffer* buffer) const;
  static std::chrono::steady_clock::time_point in(std::int64_t ns) {
    return std::chrono::steady_clock::now() + std::chrono::nanoseconds(ns);
  }
  bool linked_now() const { return pad_ != nullptr && gst_pad_is_linked(pad_); }

  mutable std::mutex
      mutex_;  // protects all below, and what is put away; no pad is pushed to with it
  std::condition_variable changed_;
  GstSegment segment_;
  bool live_ = false, ended_ = false, flushing_ = true, unlocked_ = false;

 private:
  static SidePad& of(GstPad* pad);
  static GstFlowReturn chain(GstPad* pad, GstObject*, GstBuffer* buffer);
  static gboolean event(GstPad* pad, GstObject*, GstEvent* event);
  static gboolean query(GstPad* pad, GstObject* parent, GstQuery* query);
  static gboolean activate(GstPad* pad, GstObject*, GstPadMode mode, gboolean active);
  bool hear(GstPad* pad, GstEvent* event);
  void reset(bool flushing);

  GstPad* pad_ = nullptr;  // the element's
};

template <typename Known>
void SidePad::wait(Lock& lock, std::optional<std::int64_t> longest, Known known) {
  const auto done = [&] { return over() || known(); };
  if (longest) {
    changed_.wait_until(lock, in(*longest), done);
    return;
  }
  // Who is unlinked meanwhile tells nobody, and who turns out to be live is not waited for.
  while (!done() && !live_ && linked_now()) changed_.wait_until(lock, in(GST_SECOND));
}

template <typename Ahead>
GstFlowReturn SidePad::hold(Lock& lock, Ahead ahead) {
  changed_.wait(lock, [&] { return flushing_ || live_ || !ahead(); });
  return flushing_ ? GST_FLOW_FLUSHING : GST_FLOW_OK;
}

}  // namespace polyhull::element
