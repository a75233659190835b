// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/punctuality.h"

namespace polyhull {

void Punctuality::note(std::int64_t now, std::int64_t time) {
  const std::scoped_lock lock(mutex_);
  last_arrival_ = now;
  all_.add(now, now - time);
  if (now - time <= limit_) window_.add(now, now - time);
}

void Punctuality::set_limit(std::int64_t limit) {
  const std::scoped_lock lock(mutex_);
  limit_ = limit;
}

void Punctuality::note_reported(std::int64_t latency) {
  const std::scoped_lock lock(mutex_);
  reported_ = latency;
}

std::optional<std::int64_t> Punctuality::latest(std::int64_t now) const {
  const std::scoped_lock lock(mutex_);
  return window_.largest(now);
}

std::optional<std::int64_t> Punctuality::latest_of_all(std::int64_t now) const {
  const std::scoped_lock lock(mutex_);
  return all_.largest(now);
}

std::optional<std::int64_t> Punctuality::last_arrival() const {
  const std::scoped_lock lock(mutex_);
  return last_arrival_;
}

std::int64_t Punctuality::reported() const {
  const std::scoped_lock lock(mutex_);
  return reported_;
}

void Punctuality::reset() {
  const std::scoped_lock lock(mutex_);
  window_.reset();
  all_.reset();
  last_arrival_.reset();
}

}  // namespace polyhull
