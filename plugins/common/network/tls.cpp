// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/network/tls.h"

#include "base/error.h"

namespace polyhull::element {

std::string take_message(GError* error) {
  std::string message = error != nullptr ? error->message : "no reason is given";
  g_clear_error(&error);
  return message;
}

TlsIdentity::TlsIdentity(const std::string& certificate, const std::string& authority) {
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

GRef<GIOStream> TlsIdentity::connection(GType type, GIOStream* plain, const char* property,
                                        gpointer value) const {
  GError* error = nullptr;
  // With the database from the start: without one all of the system's authorities are read for each
  // connection, which a flood of them would be paid for.
  GRef<GIOStream> stream(static_cast<GIOStream*>(
      g_initable_new(type, nullptr, &error, "base-io-stream", plain, "certificate",
                     certificate_.get(), "database", authority_.get(), property, value, nullptr)));
  if (stream == nullptr)
    throw Error(Error::Kind::io, "TLS does not start: {}", take_message(error));
  return stream;
}

GRef<GIOStream> TlsIdentity::client(GIOStream* plain, const std::string& name) const {
  g_autoptr(GSocketConnectable) identity = g_network_address_new(name.c_str(), 0);
  return connection(g_tls_backend_get_client_connection_type(g_tls_backend_get_default()), plain,
                    "server-identity", identity);
}

GRef<GIOStream> TlsIdentity::server(GIOStream* plain) const {
  GRef<GIOStream> stream =
      connection(g_tls_backend_get_server_connection_type(g_tls_backend_get_default()), plain,
                 nullptr, nullptr);
  // A server's connection accepts nobody by itself.
  const auto accept = +[](GTlsConnection*, GTlsCertificate*, GTlsCertificateFlags wrong,
                          gpointer) -> gboolean { return wrong == 0; };
  g_signal_connect(stream.get(), "accept-certificate", G_CALLBACK(accept), nullptr);
  g_object_set(stream.get(), "authentication-mode", G_TLS_AUTHENTICATION_REQUIRED, nullptr);
  return stream;
}

}  // namespace polyhull::element
