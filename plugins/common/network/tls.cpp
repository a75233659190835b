// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/network/tls.h"

#include <algorithm>
#include <utility>

#include "base/error.h"

namespace polyhull::element {
namespace {

constexpr char other_name[] = "polyhull-other-name";

}  // namespace

std::vector<std::string> words_of(const std::string& text) {
  constexpr char gaps[] = ", \t\n";
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_not_of(gaps); at != std::string::npos;) {
    const std::size_t end = std::min(text.find_first_of(gaps, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(gaps, end);
  }
  return words;
}

std::string take_message(GError* error) {
  std::string message = error != nullptr ? error->message : "no reason is given";
  g_clear_error(&error);
  return message;
}

TlsIdentity::TlsIdentity(const std::string& certificate, const std::string& authority,
                         std::vector<std::string> clients)
    : clients_(std::move(clients)) {
  if (certificate.empty() && authority.empty()) return;
  if (certificate.empty() || authority.empty())
    throw Error(Error::Kind::bad_input,
                "Only {} is set; TLS takes tls-certificate, which says who this machine is, and "
                "tls-authority, which says whom it trusts.",
                certificate.empty() ? "tls-authority" : "tls-certificate");
  if (!g_tls_backend_supports_tls(g_tls_backend_get_default()))
    throw Error(Error::Kind::unsupported,
                "TLS is asked for and GLib has none; install Debian's glib-networking.");
  GError* error = nullptr;
  certificate_.reset(g_tls_certificate_new_from_file(certificate.c_str(), &error));
  if (certificate_ == nullptr)
    throw Error(Error::Kind::bad_input,
                "tls-certificate '{}' cannot be used: {}. It is a PEM file with a certificate and "
                "its private key.",
                certificate, take_message(error));
  g_autofree gchar* key = nullptr;
  g_object_get(certificate_.get(), "private-key-pem", &key, nullptr);
  if (key == nullptr)
    throw Error(Error::Kind::bad_input,
                "tls-certificate '{}' has no private key in it: append the key's PEM to the "
                "certificate's.",
                certificate);
  g_autofree gchar* path = g_canonicalize_filename(authority.c_str(), nullptr);
  authority_.reset(g_tls_file_database_new(path, &error));
  if (authority_ == nullptr)
    throw Error(Error::Kind::bad_input,
                "tls-authority '{}' cannot be used: {}. It is a PEM file with the certificates of "
                "who signs the machines'.",
                authority, take_message(error));
}

Ref<GIOStream> TlsIdentity::connection(GType type, GIOStream* plain, const char* property,
                                       gpointer value) const {
  GError* error = nullptr;
  // With the database from the start: without one all of the system's authorities are read for each
  // connection, which a flood of them would be paid for.
  Ref<GIOStream> stream(static_cast<GIOStream*>(
      g_initable_new(type, nullptr, &error, "base-io-stream", plain, "certificate",
                     certificate_.get(), "database", authority_.get(), property, value, nullptr)));
  if (stream == nullptr)
    throw Error(Error::Kind::io, "TLS does not start: {}", take_message(error));
  return stream;
}

Ref<GIOStream> TlsIdentity::client(GIOStream* plain, const std::string& name) const {
  g_autoptr(GSocketConnectable) identity = g_network_address_new(name.c_str(), 0);
  return connection(g_tls_backend_get_client_connection_type(g_tls_backend_get_default()), plain,
                    "server-identity", identity);
}

Ref<GIOStream> TlsIdentity::server(GIOStream* plain) const {
  Ref<GIOStream> stream =
      connection(g_tls_backend_get_server_connection_type(g_tls_backend_get_default()), plain,
                 nullptr, nullptr);
  // A server's connection accepts nobody by itself.
  const auto accept = +[](GTlsConnection* connection, GTlsCertificate* client,
                          GTlsCertificateFlags wrong, gpointer identity) -> gboolean {
    if (wrong != 0) return FALSE;
    if (static_cast<const TlsIdentity*>(identity)->has_name(client)) return TRUE;
    g_object_set_data(G_OBJECT(connection), other_name, connection);
    return FALSE;
  };
  g_signal_connect(stream.get(), "accept-certificate", G_CALLBACK(accept),
                   const_cast<TlsIdentity*>(this));
  g_object_set(stream.get(), "authentication-mode", G_TLS_AUTHENTICATION_REQUIRED, nullptr);
  return stream;
}

bool TlsIdentity::has_name(GTlsCertificate* client) const {
  return clients_.empty() ||
         std::any_of(clients_.begin(), clients_.end(), [client](const std::string& name) {
           g_autoptr(GSocketConnectable) identity = g_network_address_new(name.c_str(), 0);
           return (g_tls_certificate_verify(client, identity, nullptr) &
                   G_TLS_CERTIFICATE_BAD_IDENTITY) == 0;
         });
}

bool TlsIdentity::has_other_name(GIOStream* server) {
  return g_object_get_data(G_OBJECT(server), other_name) != nullptr;
}

}  // namespace polyhull::element
