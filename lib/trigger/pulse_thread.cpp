// SPDX-License-Identifier: LGPL-2.1-or-later
#include "trigger/pulse_thread.h"

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "base/nanoseconds.h"

namespace polyhull {
namespace {

__extension__ typedef __int128 Int128;

constexpr std::int64_t millisecond = 1000000;
// Longest uninterrupted sleep: how soon a changed rate or the end is noticed.
constexpr std::int64_t nap = 20 * millisecond;
constexpr std::int64_t retry_interval = 200 * millisecond;

std::int64_t monotonic() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * second + now.tv_nsec;
}

void sleep_monotonic(std::int64_t until) {
  const timespec time{static_cast<time_t>(until / second), static_cast<long>(until % second)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

// Clock minus monotonic time, from the tightest of a few readings.
std::int64_t offset_of(const std::function<std::int64_t()>& clock) {
  std::int64_t best = 0, best_gap = INT64_MAX;
  for (int i = 0; i < 3; ++i) {
    const std::int64_t before = monotonic();
    const std::int64_t time = clock();
    const std::int64_t gap = monotonic() - before;
    if (gap >= best_gap) continue;
    best_gap = gap;
    best = time - before - gap / 2;
  }
  return best;
}

bool make_real_time(std::thread& thread) {
  sched_param parameter{};
  parameter.sched_priority =
      (sched_get_priority_min(SCHED_FIFO) + sched_get_priority_max(SCHED_FIFO)) / 2;
  return pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &parameter) == 0;
}

}  // namespace

std::int64_t PulseParameters::period() const {
  return rate_numerator > 0 ? second * rate_denominator / rate_numerator : 0;
}

std::int64_t PulseParameters::pulse_taken() const {
  return mode == PulseMode::zeros
             ? SerialLine::duration_of(SerialLine::bytes_for(pulse, baud), baud)
             : pulse;
}

void PulseParameters::check() const {
  if (pulse < millisecond)
    throw Error(Error::Kind::bad_input,
                "A pulse of {} ns is too short for cameras; give at least 1000000 ns (1 ms).",
                pulse);
  if (period() > 0 && pulse_taken() + millisecond > period())
    throw Error(Error::Kind::bad_input,
                "A pulse of {} us does not fit into the time between pulses, {} us, with a "
                "millisecond to spare; lower the rate or shorten the pulse.",
                pulse_taken() / 1000, period() / 1000);
}

PulseThread::PulseThread(std::unique_ptr<SerialLine> line, const PulseParameters& parameters,
                         std::function<std::int64_t()> clock, std::uint64_t first_number,
                         PulseListener listener)
    : line_(std::move(line)),
      clock_(std::move(clock)),
      number_(first_number),
      listener_(std::move(listener)),
      parameters_(parameters) {
  std::unique_lock lock(mutex_);  // until real_time_ is known
  thread_ = std::thread([this] { run(); });
  real_time_ = make_real_time(thread_);
}

PulseThread::~PulseThread() {
  std::uint64_t ignored = 0;
  if (thread_.joinable()) stop(ignored);
}

void PulseThread::set(const PulseParameters& parameters) {
  const std::scoped_lock lock(mutex_);
  new_grid_ = new_grid_ || parameters.rate_numerator != parameters_.rate_numerator ||
              parameters.rate_denominator != parameters_.rate_denominator;
  parameters_.rate_numerator = parameters.rate_numerator;
  parameters_.rate_denominator = parameters.rate_denominator;
  parameters_.pulse = parameters.pulse;
  parameters_.timeout = parameters.timeout;
  changed_.notify_all();
}

void PulseThread::fire() {
  const std::scoped_lock lock(mutex_);
  if (demands_++ == 0) demanded_ = clock_();
  changed_.notify_all();
}

std::unique_ptr<SerialLine> PulseThread::stop(std::uint64_t& next_number) {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  thread_.join();
  next_number = number_;
  return std::move(line_);
}

// Whether it is time for a pulse that follows a demand, or the lack of one; else sleeps a while.
bool PulseThread::follow_turn(std::unique_lock<std::mutex>& lock, const PulseParameters& parameters,
                              std::int64_t& planned) {
  const std::int64_t now = monotonic();
  const bool first = began_ == INT64_MIN;
  const bool asked = demands_ > 0;
  std::int64_t due = now;
  if (!first)
    due =
        began_ + (asked ? parameters.period() : std::max(parameters.timeout, parameters.period()));
  if (due > now) {
    changed_.wait_for(lock, std::chrono::nanoseconds(due - now));
    return false;
  }
  const std::int64_t time = clock_();
  planned = time - (now - due);
  if (asked) planned = std::max(planned, demanded_);
  demands_ = 0;
  if (!first && !asked) {
    lock.unlock();
    listener_.timed_out();
    lock.lock();
  }
  return true;
}

// Waits for the next pulse of the grid or a demand. False: stop.
bool PulseThread::wait_for_turn(PulseParameters& parameters, std::int64_t& planned) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (stopping_) return false;
    parameters = parameters_;
    if (parameters.follow) {
      if (follow_turn(lock, parameters, planned)) return true;
      continue;
    }
    if (demands_ > 0) {
      --demands_;
      planned = demanded_;
      demanded_ = clock_();
      return true;
    }
    const std::int64_t period = parameters.period();
    if (period == 0) {
      changed_.wait(lock);
      continue;
    }
    const std::int64_t offset = offset_of(clock_);
    const std::int64_t now = monotonic() + offset;
    if (std::exchange(new_grid_, false)) {
      origin_ = now + period;
      slot_ = 0;
    }
    // Exact for any slot: the product is taken in 128 bits.
    const auto time_of = [&](std::int64_t slot) {
      return origin_ +
             static_cast<std::int64_t>(static_cast<Int128>(slot) * second *
                                       parameters.rate_denominator / parameters.rate_numerator);
    };
    std::int64_t due = time_of(slot_);
    if (now - due > period / 2) {  // held up, or the clock was set
      const std::int64_t missed = (now - due) / period + 1;
      slot_ += missed;
      due = time_of(slot_);
      lock.unlock();
      listener_.skipped(static_cast<std::uint64_t>(missed));
      lock.lock();
      continue;
    }
    if (due - now > period + second) {  // the clock was set back
      new_grid_ = true;
      continue;
    }
    const std::int64_t wake = due - offset;
    if (due - now > nap) {
      changed_.wait_for(lock, std::chrono::nanoseconds(due - now - nap / 2));
      continue;
    }
    ++slot_;
    lock.unlock();
    sleep_monotonic(wake);
    planned = due;
    return true;
  }
}

void PulseThread::give_pulse(const PulseParameters& parameters, std::int64_t planned) {
  // Two that touch would be one for the cameras.
  if (monotonic() < free_) sleep_monotonic(free_);
  const std::int64_t offset = offset_of(clock_);
  const std::int64_t begin = monotonic();
  began_ = begin;
  free_ = begin + parameters.pulse_taken() + millisecond;
  const Pulse pulse{number_, begin + offset, begin + offset - planned};
  listener_.begins(pulse);
  SerialLine::Result result =
      line_->begin_pulse(SerialLine::bytes_for(parameters.pulse, parameters.baud));
  if (result == SerialLine::Result::done) {
    ++number_;
    if (parameters.mode != PulseMode::zeros) {
      // From when the line is surely up: cameras may miss a pulse that is too short.
      const std::int64_t end = monotonic() + parameters.pulse;
      free_ = end + millisecond;
      sleep_monotonic(end);
      result = line_->end_pulse();
    }
    listener_.pulsed(pulse);
  } else {
    listener_.withdrawn();
  }
  if (result == SerialLine::Result::blocked) listener_.blocked();
  if (result == SerialLine::Result::lost) {
    line_.reset();
    listener_.lost("it was unplugged or its driver gave up");
  }
}

void PulseThread::find_device(const PulseParameters& parameters) {
  try {
    line_ = std::make_unique<SerialLine>(parameters.device, parameters.baud, parameters.mode);
  } catch (const Error&) {
    std::unique_lock lock(mutex_);
    if (!stopping_) changed_.wait_for(lock, std::chrono::nanoseconds(retry_interval));
    return;
  }
  listener_.returned();
  const std::scoped_lock lock(mutex_);
  new_grid_ = true;
}

void PulseThread::run() {
  { const std::scoped_lock started(mutex_); }
  for (;;) {
    PulseParameters parameters;
    if (line_ == nullptr) {
      {
        const std::scoped_lock lock(mutex_);
        if (stopping_) return;
        parameters = parameters_;
      }
      find_device(parameters);
      continue;
    }
    std::int64_t planned = 0;
    if (!wait_for_turn(parameters, planned)) return;
    give_pulse(parameters, planned);
  }
}

}  // namespace polyhull
