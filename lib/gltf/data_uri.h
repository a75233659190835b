// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Addresses within a glTF file: data that stand in the address itself (RFC 2397), file names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace polyhull {

/// Whether \p uri holds its data itself ("data:...", in any case of letters).
bool is_data_uri(std::string_view uri);

/// The bytes of data URI \p uri, of whatever type, or of none: base64 (with line ends, without the
/// signs at its end, in the alphabet for addresses, too), or escaped by %XX. Throws Error
/// (bad_input), beginning with \p source and never with a part of the data, for what is neither.
std::vector<unsigned char> decode_data_uri(std::string_view uri, const std::string& source);

/// \p uri for messages: a file's name, cut where it is too long for one, without data.
std::string address_name(std::string_view uri);

/// \p text with each %XX as the byte that it stands for; other % stay.
std::string unescape(std::string_view text);

}  // namespace polyhull
