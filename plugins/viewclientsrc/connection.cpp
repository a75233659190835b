// SPDX-License-Identifier: LGPL-2.1-or-later
// viewclientsrc's connection: made, read within its limits, cut.
#include "base/error.h"
#include "plugins/viewclientsrc/private.h"

namespace polyhull::element {
namespace {

Cut not_trusted(const std::string& what) {
  return {"refused-keys",
          fmt::format("{}. Look at the certificate that each shows, the authority that each "
                      "trusts, and the name that the sender's is for (tls-name).",
                      what)};
}

}  // namespace

void announce(GstElement* element, const ViewClientSettings& settings, bool connected,
              const char* reason) {
  gst_element_post_message(
      element,
      gst_message_new_element(
          GST_OBJECT(element),
          gst_structure_new("polyhull-link", "host", G_TYPE_STRING, settings.host.c_str(), "port",
                            G_TYPE_UINT, settings.port, "connected", G_TYPE_BOOLEAN, connected,
                            "reason", G_TYPE_STRING, reason, nullptr)));
}

std::string name_of(const ViewClientSettings& settings) {
  return fmt::format("{}:{}", settings.host, settings.port);
}

/// One attempt; false where it failed, which is said once until there is a connection again.
bool ViewClientSrc::connect(GstElement* element, const ViewClientSettings& now) {
  try {
    link = std::make_unique<Link>(now.host, static_cast<int>(now.port), identity,
                                  now.tls_name.empty() ? now.host : now.tls_name,
                                  static_cast<std::int64_t>(now.timeout), cancel.get());
  } catch (const NotTrusted& error) {
    cut(element, now,
        not_trusted(fmt::format("the two ends do not trust each other ({})", error.what())));
    return false;
  } catch (const Error& error) {
    if (g_cancellable_is_cancelled(cancel.get())) return false;
    if (lost) {
      statistics.count("connections-failed");
      GST_INFO_OBJECT(element, "%s", error.what());
    } else {
      lost = true;
      statistics.warn(element, "connections-failed",
                      fmt::format("{}. It is tried until there is an answer.", error.what()));
      announce(element, now, false, error.what());
    }
    return false;
  }
  statistics.count("connections");
  GST_DEBUG_OBJECT(element, "is connected to %s", name_of(now).c_str());
  limit = RateLimit();
  waits = g_get_monotonic_time();
  told.clear();
  unsent.clear();
  format.reset();
  gst_segment_init(&segment, GST_FORMAT_TIME);
  first = true;
  return true;
}

void ViewClientSrc::cut(GstElement* element, const ViewClientSettings& now, const Cut& reason) {
  link.reset();
  if (reason.counter == nullptr) return;
  statistics.count("cuts");
  const std::string why = fmt::format("The connection to {} is cut: {}", name_of(now), reason.why);
  statistics.warn(element, reason.counter, why);
  if (!lost) announce(element, now, false, why.c_str());
  lost = true;
}

void ViewClientSrc::read(std::span<std::uint8_t> bytes, const ViewClientSettings& now) {
  const auto left =
      static_cast<std::int64_t>(now.timeout) - 1000 * (g_get_monotonic_time() - waits);
  switch (link->read(bytes, left)) {
    case LinkResult::done:
      return;
    case LinkResult::cancelled:
      throw Cut{nullptr, {}};
    case LinkResult::ended:
      // gdppay sends no end of stream: its sink closes the connection.
      if (now.end_with_sender) {
        statistics.count("ends-of-sender");
        throw EndOfStream{};
      }
      throw Cut{"ends-of-sender", "the sender, or the network, has ended it."};
    case LinkResult::refused:
      throw not_trusted(
          fmt::format("it was ended before anything came ({}): the sender is stopping, or, more "
                      "likely where this lasts, the two ends do not trust each other",
                      link->why()));
    case LinkResult::silent:
      throw Cut{"silences",
                fmt::format("no whole frame came for {} ms. Look at the sender and the "
                            "link, or set timeout higher.",
                            now.timeout / GST_MSECOND),
                true};
  }
}

/// The next packet's header, if what it announces is within the limits.
PacketHeader ViewClientSrc::read_header(const ViewClientSettings& now) {
  std::uint8_t bytes[packet_header_size];
  read(bytes, now);
  PacketHeader header;
  try {
    header = read_packet_header(bytes);
  } catch (const Error& error) {
    throw Cut{"refused-packets", error.what()};
  }
  const std::uint64_t most =
      header.kind == PacketKind::buffer ? now.max_packet : std::uint64_t{longest_text};
  if (header.size > most)
    throw Cut{"refused-sizes",
              fmt::format("a packet announces {} bytes, and {} are allowed{}.", header.size, most,
                          header.kind == PacketKind::buffer ? " by max-packet" : " for its kind")};
  if (!limit.allows(packet_header_size + header.size, now.max_rate, g_get_monotonic_time()))
    throw Cut{"refused-rates",
              fmt::format("it brings more than {} packets a second, or than max-rate allows.",
                          RateLimit::packets_per_second)};
  return header;
}

std::string too_long(const std::string& settings) {
  return fmt::format(
      "settings has {} bytes and is not sent: {} are the most that the sender takes at once. Set "
      "fewer of its properties.",
      settings.size(), longest_settings);
}

/// Tells the sender what has changed in the settings for it.
void ViewClientSrc::tell(GstElement* element, const ViewClientSettings& now) {
  if (now.settings != told && unsent.empty()) {
    told = now.settings;
    // Without any the sender keeps those that it has; too long a line would cost the connection.
    if (told.size() > longest_settings) {
      statistics.warn(element, "settings-refused", too_long(told));
    } else if (!told.empty()) {
      for (const char c : told) unsent += c == '\n' ? ' ' : c;
      unsent += '\n';
    }
  }
  if (!unsent.empty()) link->send(unsent);
}

}  // namespace polyhull::element
