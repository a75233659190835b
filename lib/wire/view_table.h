// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// View to FlatBuffer table and back; shared by the two payloads. Internal.
#pragma once

#include <cstring>
#include <string>

#include "base/error.h"
#include "wire/pixel_coding.h"
#include "wire/view_generated.h"
#include "wire/view_payload.h"

namespace polyhull {

/// How a view's pixel block is stored.
struct StoredPixels {
  PixelCoding coding = PixelCoding::raw;
  int stride = 0;         ///< bytes from row to row, of what it is unpacked to
  std::size_t bytes = 0;  ///< of the block
};

/// Throws Error (unsupported) for contours that are too long for a payload.
flatbuffers::Offset<wire::View> pack_view(flatbuffers::FlatBufferBuilder& builder, const View& view,
                                          const StoredPixels& pixels);

/// With its pixels as they are.
inline flatbuffers::Offset<wire::View> pack_view(flatbuffers::FlatBufferBuilder& builder,
                                                 const View& view) {
  return pack_view(builder, view, {PixelCoding::raw, view.stride, view.pixels.size()});
}

/// The table of a payload. Throws Error for a FlatBuffer that is damaged.
const wire::View& verified_view(const Payload& payload);

/// The view without its pixels, not validated. Throws Error for numbers beyond 31 bits.
View unpack_all_but_pixels(const wire::View& table);

/// Throws Error where anything but the pixels breaks a rule of read_view().
void validate_all_but_pixels(const View& view);

/// Takes the view's pixel block from \p payload and validates the whole. Throws Error.
View unpack_view(const wire::View& table, Payload& payload);

/// Copies a vector of numbers whose elements lie as T's members do; null: none. Throws Error where
/// they do not make whole Ts.
template <typename T, typename Element>
std::vector<T> unpack_numbers(const flatbuffers::Vector<Element>* numbers) {
  static_assert(sizeof(T) % sizeof(Element) == 0);
  constexpr std::size_t each = sizeof(T) / sizeof(Element);
  std::vector<T> result;
  if (!numbers || numbers->size() == 0) return result;
  if (numbers->size() % each != 0)
    throw Error(Error::Kind::bad_input,
                "A list of {} numbers came where groups of {} are expected.", numbers->size(),
                each);
  result.resize(numbers->size() / each);
  std::memcpy(static_cast<void*>(result.data()), numbers->Data(),
              numbers->size() * sizeof(Element));
  return result;
}

}  // namespace polyhull
