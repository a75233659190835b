// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Times of several ways to do the same, taken turn by turn so that a busy machine slows them
/// alike, and tables as CSV.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace polyhull::benchmark {

/// What \p clock shows, in milliseconds: CLOCK_MONOTONIC, CLOCK_PROCESS_CPUTIME_ID.
inline double now(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// 0 for none.
inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// The median time of \p work in milliseconds, repeated for about \p seconds, at least \p least times and
/// at most \p most, and once before that is not counted.
inline double median_ms(const std::function<void()>& work, double seconds, std::size_t least,
                        std::size_t most) {
  std::vector<double> times;
  work();
  for (double total = 0.0; times.size() < least || (total < seconds && times.size() < most);) {
    const double begin = now(CLOCK_MONOTONIC);
    work();
    times.push_back(now(CLOCK_MONOTONIC) - begin);
    total += 1e-3 * times.back();
  }
  return median(times);
}

/// One way to do the job; the argument counts the calls, so that frames can take turns.
struct Contender {
  std::string name;
  std::function<void(int)> run;
  std::vector<double> times{};  ///< ms per call

  double median() const { return quantile(0.5); }
  double best() const { return quantile(0.0); }
  double quantile(double q) const {
    std::vector<double> sorted = times;
    std::sort(sorted.begin(), sorted.end());
    return sorted.empty() ? 0.0 : sorted[static_cast<std::size_t>(q * (sorted.size() - 1))];
  }
};

/// Runs \p rounds rounds, in each every contender once, and one round before that is not counted.
inline void race(std::vector<Contender>& contenders, int rounds) {
  for (int round = -1; round < rounds; ++round) {
    for (Contender& contender : contenders) {
      const auto begin = std::chrono::steady_clock::now();
      contender.run(round + 1);
      const auto end = std::chrono::steady_clock::now();
      if (round < 0) continue;
      contender.times.push_back(std::chrono::duration<double, std::milli>(end - begin).count());
    }
  }
}

/// The best time of a contender. Bars compare best times: what other programs take from a busy
/// machine is not the contender's.
inline double best_of(const std::vector<Contender>& contenders, const std::string& name) {
  for (const Contender& contender : contenders) {
    if (contender.name == name) return contender.best();
  }
  throw std::runtime_error("no contender " + name);
}

/// A CSV file that is printed to the terminal too.
class Table {
 public:
  /// \p append: to the rows that the file has, without the header.
  Table(const std::string& path, const std::string& header, bool append = false)
      : file_(std::fopen(path.c_str(), append ? "a" : "w")) {
    if (file_ == nullptr) throw std::runtime_error("cannot write " + path);
    std::printf("\n# %s\n", path.c_str());
    if (append)
      std::printf("%s\n", header.c_str());
    else
      line(header);
  }
  ~Table() { std::fclose(file_); }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  void line(const std::string& text) {
    std::fprintf(file_, "%s\n", text.c_str());
    std::printf("%s\n", text.c_str());
    std::fflush(file_);
    std::fflush(stdout);
  }
  template <class... Arguments>
  void row(const char* format, Arguments... arguments) {
    char text[512];
    std::snprintf(text, sizeof text, format, arguments...);
    line(text);
  }

 private:
  std::FILE* file_;
};

/// Keeps a result from being optimised away.
template <class T>
inline void keep(const T& value) {
  asm volatile("" : : "r,m"(value) : "memory");
}

/// Bars of the issue: "ok" or "MISSED" beside what was measured.
inline const char* bar(bool held) {
  return held ? "ok" : "MISSED";
}

}  // namespace polyhull::benchmark
