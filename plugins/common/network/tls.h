// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Who a machine is and whom it trusts, by GIO's TLS: both ends show a certificate, and each must be
/// signed by an authority that the other one names.
#pragma once

#include <gio/gio.h>

#include <string>
#include <vector>

#include "plugins/common/references.h"

namespace polyhull::element {

/// Frees \p error and gives its sentence.
std::string take_message(GError* error);

/// The words of \p text, between spaces, commas and line ends.
std::vector<std::string> words_of(const std::string& text);

class TlsIdentity {
 public:
  /// No TLS.
  TlsIdentity() = default;

  /// Reads the PEM files \p certificate, with this machine's certificate and its private key, and
  /// \p authority, with the certificates of who signs those that are trusted; both empty: no TLS.
  /// \p clients: the names, for one of which the certificate of a server's client must be; none: any
  /// that \p authority signs. Throws Error where only one is given, a file cannot be used, or GIO has
  /// no TLS.
  TlsIdentity(const std::string& certificate, const std::string& authority,
              std::vector<std::string> clients = {});

  explicit operator bool() const { return certificate_ != nullptr; }

  /// \p plain as the client's end of a TLS connection to a server whose certificate is for \p name;
  /// the handshake is to be made. Throws Error.
  Ref<GIOStream> client(GIOStream* plain, const std::string& name) const;

  /// \p plain as the server's end, where the client must show a certificate. This must outlive it.
  /// Throws Error.
  Ref<GIOStream> server(GIOStream* plain) const;

  /// Whether \p server refuses its client for its name, not for who has signed it.
  static bool has_other_name(GIOStream* server);

 private:
  /// \p property, with \p value, is one more of \p type; null: none.
  Ref<GIOStream> connection(GType type, GIOStream* plain, const char* property,
                            gpointer value) const;
  bool has_name(GTlsCertificate* client) const;

  Ref<GTlsCertificate> certificate_;
  Ref<GTlsDatabase> authority_;
  std::vector<std::string> clients_;
};

}  // namespace polyhull::element
