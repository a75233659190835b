// SPDX-License-Identifier: LGPL-2.1-or-later
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <random>

namespace polyhull::test {

/// Runs \p begin in a child process, then what it returned for 0, 1, … until the child is killed: some time
/// after one of the first 30. The last number that ended.
inline int last_of_killed(const std::function<std::function<void(int)>()>& begin,
                          std::mt19937& random) {
  int told[2];
  if (pipe(told) != 0) return -1;
  const pid_t child = fork();
  if (child == 0) {
    const std::function<void(int)> write_set = begin();
    for (int i = 0;; ++i) {
      write_set(i);
      if (::write(told[1], &i, sizeof i) != sizeof i) _exit(1);
    }
  }
  close(told[1]);
  int last = -1;
  const int after = static_cast<int>(random() % 30);
  while (last < after && read(told[0], &last, sizeof last) == sizeof last) {
  }
  usleep(random() % 3000);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  while (read(told[0], &last, sizeof last) == sizeof last) {
  }
  close(told[0]);
  return last;
}

}  // namespace polyhull::test
