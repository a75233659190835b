// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A serial device without hardware: what is written on one side of a pseudo-terminal is read on
/// the other.
#pragma once

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace polyhull::test {

class Terminal {
 public:
  Terminal() {
    char name[128];
    int slave = -1;
    if (openpty(&master_, &slave, name, nullptr, nullptr) != 0) std::abort();
    device = name;
    fcntl(master_, F_SETFL, O_NONBLOCK);
    close(slave);  // the element opens it
  }
  ~Terminal() { unplug(); }
  Terminal(const Terminal&) = delete;
  void unplug() {
    if (master_ >= 0) close(master_);
    master_ = -1;
  }
  std::string read_all() const {
    std::string bytes;
    char block[4096];
    for (ssize_t count; (count = read(master_, block, sizeof block)) > 0;)
      bytes.append(block, static_cast<std::size_t>(count));
    return bytes;
  }
  std::string device;

 private:
  int master_ = -1;
};

}  // namespace polyhull::test
