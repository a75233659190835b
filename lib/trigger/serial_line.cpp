// SPDX-License-Identifier: LGPL-2.1-or-later
#include "trigger/serial_line.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "base/error.h"

namespace polyhull {
namespace {

constexpr std::uint32_t bits_per_byte = 10;  // start, eight data, stop

speed_t speed_of(std::uint32_t baud) {
  struct Speed {
    std::uint32_t baud;
    speed_t code;
  };
  constexpr Speed speeds[] = {
      {300, B300},       {600, B600},       {1200, B1200},    {2400, B2400},   {4800, B4800},
      {9600, B9600},     {19200, B19200},   {38400, B38400},  {57600, B57600}, {115200, B115200},
      {230400, B230400}, {460800, B460800}, {921600, B921600}};
  for (const Speed& speed : speeds)
    if (speed.baud == baud) return speed.code;
  throw Error(Error::Kind::unsupported,
              "{} baud is no usual rate; use 300, 600, 1200, 2400, 4800, 9600, 19200, 38400, "
              "57600, 115200, 230400, 460800 or 921600.",
              baud);
}

[[noreturn]] void fail_to_open(const std::string& device) {
  const int reason = errno;
  const std::string what =
      fmt::format("The serial device '{}' cannot be opened: {}", device, std::strerror(reason));
  if (reason == EACCES || reason == EPERM)
    throw Error(Error::Kind::io,
                "{}. Add your user to the group of the device (on Debian: adduser $USER dialout, "
                "then log in again).",
                what);
  if (reason == EBUSY)
    throw Error(Error::Kind::io, "{}. Another program has it open for itself.", what);
  throw Error(Error::Kind::not_found,
              "{}. Check that it is plugged in; ls /dev/ttyS* /dev/ttyUSB* /dev/ttyACM* shows what "
              "there is.",
              what);
}

bool set_up(int file, std::uint32_t baud) {
  termios settings{};
  if (tcgetattr(file, &settings) != 0) return false;
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~(CRTSCTS | CSTOPB | HUPCL);
  const speed_t speed = speed_of(baud);
  cfsetispeed(&settings, speed);
  cfsetospeed(&settings, speed);
  if (tcsetattr(file, TCSANOW, &settings) != 0) return false;
  // tcsetattr() is content with any part of the request.
  return tcgetattr(file, &settings) == 0 && cfgetospeed(&settings) == speed;
}

}  // namespace

SerialLine::SerialLine(const std::string& device, std::uint32_t baud, PulseMode mode)
    : mode_(mode) {
  speed_of(baud);
  file_ = open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) fail_to_open(device);
  const auto refuse = [&](const std::string& what) {
    close(file_);
    throw Error(Error::Kind::unsupported, "The serial device '{}' {}.", device, what);
  };
  if (!isatty(file_)) refuse("is not a serial device");
  if (!set_up(file_, baud)) refuse(fmt::format("does not take {} baud, 8N1", baud));
  if (mode == PulseMode::rts || mode == PulseMode::dtr) {
    int lines = 0;
    if (ioctl(file_, TIOCMGET, &lines) != 0 || set_line(false) != Result::done)
      refuse("has no RTS and DTR lines; use mode=zeros or mode=break");
  }
}

SerialLine::~SerialLine() {
  if (mode_ != PulseMode::zeros) set_line(false);
  close(file_);
}

std::uint32_t SerialLine::bytes_for(std::int64_t pulse, std::uint32_t baud) {
  const std::int64_t byte = duration_of(1, baud);
  return static_cast<std::uint32_t>(std::max<std::int64_t>((pulse + byte - 1) / byte, 1));
}

std::int64_t SerialLine::duration_of(std::uint32_t bytes, std::uint32_t baud) {
  return std::int64_t{1000000000} * bits_per_byte * bytes / baud;
}

SerialLine::Result SerialLine::set_line(bool on) {
  int done = -1;
  if (mode_ == PulseMode::line_break) {
    done = ioctl(file_, on ? TIOCSBRK : TIOCCBRK);
  } else {
    const int line = mode_ == PulseMode::rts ? TIOCM_RTS : TIOCM_DTR;
    done = ioctl(file_, on ? TIOCMBIS : TIOCMBIC, &line);
  }
  return done == 0 ? Result::done : Result::lost;
}

SerialLine::Result SerialLine::begin_pulse(std::uint32_t bytes) {
  if (mode_ != PulseMode::zeros) return set_line(true);
  constexpr std::array<char, 1024> zeros{};
  while (bytes > 0) {
    const ssize_t written = write(file_, zeros.data(), std::min<std::size_t>(bytes, zeros.size()));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno == EAGAIN ? Result::blocked : Result::lost;
    if (written == 0) return Result::blocked;
    bytes -= static_cast<std::uint32_t>(written);
  }
  return Result::done;
}

SerialLine::Result SerialLine::end_pulse() {
  return mode_ == PulseMode::zeros ? Result::done : set_line(false);
}

}  // namespace polyhull
