// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewserversink/allowed_addresses.h"

#include <algorithm>
#include <array>

#include "base/error.h"

namespace polyhull::element {
namespace {

constexpr gsize ipv4_in_ipv6 = 12;  // bytes before the four: ten of 0, two of 255

Ref<GInetAddress> plain(GInetAddress* address) {
  const guint8* bytes = g_inet_address_to_bytes(address);
  constexpr std::array<guint8, ipv4_in_ipv6> mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255};
  if (g_inet_address_get_family(address) == G_SOCKET_FAMILY_IPV6 &&
      std::equal(mapped.begin(), mapped.end(), bytes))
    return Ref<GInetAddress>(
        g_inet_address_new_from_bytes(bytes + ipv4_in_ipv6, G_SOCKET_FAMILY_IPV4));
  return Ref<GInetAddress>(G_INET_ADDRESS(g_object_ref(address)));
}

}  // namespace

AllowedAddresses::AllowedAddresses(const std::string& text) {
  if (!text.empty() && words_of(text).empty())
    throw Error(Error::Kind::bad_input,
                "allow names nobody; name the clients' addresses, or leave it empty for all.");
  for (const std::string& each : words_of(text)) {
    GError* error = nullptr;
    masks_.emplace_back(g_inet_address_mask_new_from_string(each.c_str(), &error));
    if (masks_.back() == nullptr)
      throw Error(Error::Kind::bad_input,
                  "allow has '{}', which is no address or network: {}. Expected are such as "
                  "10.0.0.5 or 10.1.0.0/16, with spaces or commas between them.",
                  each, take_message(error));
  }
}

bool AllowedAddresses::has(GInetAddress* address) const {
  if (masks_.empty()) return true;
  const Ref<GInetAddress> each = plain(address);
  return std::any_of(masks_.begin(), masks_.end(), [&](const Ref<GInetAddressMask>& mask) {
    return g_inet_address_mask_matches(mask.get(), each.get());
  });
}

std::string network_of(GInetAddress* address) {
  const Ref<GInetAddress> each = plain(address);
  constexpr gsize network = 8;
  return {reinterpret_cast<const char*>(g_inet_address_to_bytes(each.get())),
          std::min(g_inet_address_get_native_size(each.get()), network)};
}

}  // namespace polyhull::element
