// SPDX-License-Identifier: LGPL-2.1-or-later
#include "wire/payload.h"

#include <flatbuffers/util.h>

#include <bit>
#include <cstring>
#include <limits>
#include <string>

#include "base/error.h"

namespace polyhull {
namespace {

static_assert(std::endian::native == std::endian::little,
              "payloads are written and read as they lie in memory");

constexpr std::size_t header_alignment = 32;

struct Prefix {
  char magic[4];
  std::uint32_t version;
  std::uint32_t header_size;
  std::uint32_t flatbuffer_size;
  std::uint64_t pixels_size;
  std::uint64_t zero;
};
static_assert(sizeof(Prefix) == payload_prefix_size);

const char* magic(PayloadKind kind) {
  return kind == PayloadKind::view ? "PHVW" : "PHMS";
}

[[noreturn]] void fail(const char* what, const std::string& message) {
  throw Error(Error::Kind::bad_input, "Not a usable {}: {}.", what, message);
}

}  // namespace

std::size_t payload_header_size(std::size_t flatbuffer_size) {
  const std::size_t used = payload_prefix_size + flatbuffer_size;
  return (used + header_alignment - 1) / header_alignment * header_alignment;
}

std::vector<std::uint8_t> write_payload_header(PayloadKind kind, Bytes flatbuffer,
                                               std::uint64_t pixels_size) {
  const std::size_t size = payload_header_size(flatbuffer.size());
  if (size > std::numeric_limits<std::uint32_t>::max())
    throw Error(Error::Kind::unsupported,
                "The header of a {} would have {} bytes; a payload's may have less than 4 GiB.",
                kind == PayloadKind::view ? "view" : "mesh", size);
  Prefix prefix{};
  std::memcpy(prefix.magic, magic(kind), 4);
  prefix.version = payload_version;
  prefix.header_size = static_cast<std::uint32_t>(size);
  prefix.flatbuffer_size = static_cast<std::uint32_t>(flatbuffer.size());
  prefix.pixels_size = pixels_size;
  std::vector<std::uint8_t> header(size, 0);
  std::memcpy(header.data(), &prefix, sizeof prefix);
  if (!flatbuffer.empty())
    std::memcpy(header.data() + payload_prefix_size, flatbuffer.data(), flatbuffer.size());
  return header;
}

Payload::Payload(PayloadKind kind, std::span<const Bytes> segments)
    : what_(kind == PayloadKind::view ? "view" : "mesh"), segments_(segments) {
  std::uint64_t total = 0;
  for (const Bytes& segment : segments) total += segment.size();
  if (total < payload_prefix_size)
    fail(what_,
         fmt::format("it has {} bytes, its prefix alone takes {}", total, payload_prefix_size));
  const Bytes first = segments.front();
  const auto cut = [&] {
    throw Error(Error::Kind::unsupported, "The header of a {} is spread over several memories.",
                what_);
  };
  if (first.size() < payload_prefix_size) cut();
  Prefix prefix;
  std::memcpy(&prefix, first.data(), sizeof prefix);
  if (std::memcmp(prefix.magic, magic(kind), 4) != 0)
    fail(what_, fmt::format("it does not start with '{}'", magic(kind)));
  if (prefix.version != payload_version)
    throw Error(Error::Kind::bad_input,
                "A {} of format version {} came in; this build reads version {}. Have the same "
                "polyhull write and read it.",
                what_, prefix.version, payload_version);
  if (prefix.header_size % header_alignment != 0 || prefix.zero != 0 ||
      prefix.header_size < payload_prefix_size ||
      prefix.flatbuffer_size > prefix.header_size - payload_prefix_size)
    fail(what_, "the sizes in its prefix contradict each other");
  if (prefix.header_size > total || prefix.pixels_size != total - prefix.header_size)
    fail(what_, fmt::format("its prefix promises {} + {} bytes, {} came", prefix.header_size,
                            prefix.pixels_size, total));
  if (first.size() < prefix.header_size) cut();
  flatbuffer_ = first.subspan(payload_prefix_size, prefix.flatbuffer_size);
  if (reinterpret_cast<std::uintptr_t>(flatbuffer_.data()) % 8 != 0 && !flatbuffer_.empty()) {
    aligned_.resize((flatbuffer_.size() + 7) / 8);
    std::memcpy(aligned_.data(), flatbuffer_.data(), flatbuffer_.size());
    flatbuffer_ = {reinterpret_cast<const std::uint8_t*>(aligned_.data()), flatbuffer_.size()};
  }
  left_ = prefix.pixels_size;
  offset_ = prefix.header_size;
}

Bytes Payload::take_block(std::uint64_t size) {
  if (size > left_)
    fail(what_, fmt::format("a pixel block of {} bytes is promised, {} are left", size, left_));
  if (size == 0) return {};
  while (offset_ == segments_[segment_].size()) {
    ++segment_;
    offset_ = 0;
  }
  const Bytes segment = segments_[segment_];
  if (size > segment.size() - offset_)
    throw Error(Error::Kind::unsupported, "The pixels of a {} are spread over several memories.",
                what_);
  const Bytes block = segment.subspan(offset_, size);
  offset_ += size;
  left_ -= size;
  return block;
}

void Payload::finish() const {
  if (left_ != 0) fail(what_, fmt::format("{} bytes of pixels belong to no view", left_));
}

bool is_utf8(const std::string& text) {
  const char* const end = text.c_str() + text.size();
  for (const char* at = text.c_str(); at != end;)
    if (flatbuffers::FromUTF8(&at) <= 0) return false;  // the zero at the end ends a cut character
  return true;
}

}  // namespace polyhull
