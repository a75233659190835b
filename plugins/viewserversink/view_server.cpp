// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/viewserversink/view_server.h"

#include <algorithm>
#include <map>
#include <utility>

#include "base/error.h"

namespace polyhull::element {
namespace {

const char* event_of(ClientEnd why) {
  switch (why) {
    case ClientEnd::refused:
      return "refused-keys";
    case ClientEnd::uninvited:
      return "refused-names";
    case ClientEnd::late:
      return "handshakes-late";
    case ClientEnd::full:
      return "refused-full";
    case ClientEnd::noisy:
      return "refused-noise";
    case ClientEnd::slow:
      return "clients-slow";
    default:
      return "clients-closed";
  }
}

std::string address_of(GInetSocketAddress* address) {
  g_autofree gchar* text = g_inet_address_to_string(g_inet_socket_address_get_address(address));
  return std::string(text) + ":" + std::to_string(g_inet_socket_address_get_port(address));
}

guint seconds_of(std::uint64_t time) {
  return static_cast<guint>((time + GST_SECOND - 1) / GST_SECOND);
}

}  // namespace

ViewServer::ViewServer(const ViewServerSettings& settings, Listener listener, Settings said)
    : allowed_(settings.allow),
      identity_(settings.tls_certificate, settings.tls_authority, words_of(settings.tls_clients)),
      listener_(std::move(listener)),
      said_(std::move(said)),
      settings_(settings) {
  if (said_ && !identity_)
    throw Error(
        Error::Kind::bad_input,
        "settings-for is set without TLS: settings are taken from those alone who prove who "
        "they are. Set tls-certificate and tls-authority.");
  // A mistake must not let everybody in.
  if (!settings.tls_clients.empty() && (!identity_ || words_of(settings.tls_clients).empty()))
    throw Error(Error::Kind::bad_input, "tls-clients is '{}', which {}.", settings.tls_clients,
                identity_ ? "names nobody; name the clients, or leave it empty for all that "
                            "tls-authority signs"
                          : "nobody can be held to without TLS; set tls-certificate and "
                            "tls-authority");
  g_autoptr(GSocketAddress) wanted = g_inet_socket_address_new_from_string(
      settings.host.c_str(), static_cast<guint>(settings.port));
  if (wanted == nullptr)
    throw Error(Error::Kind::bad_input,
                "host is '{}', which is no address; set it to one of this machine's, or to 0.0.0.0 "
                "for all of them.",
                settings.host);
  GError* error = nullptr;
  // A burst of strangers must not keep a client from its place in the queue.
  g_socket_listener_set_backlog(socket_.get(), 128);
  g_autoptr(GSocketAddress) bound = nullptr;
  if (!g_socket_listener_add_address(socket_.get(), wanted, G_SOCKET_TYPE_STREAM,
                                     G_SOCKET_PROTOCOL_TCP, nullptr, &bound, &error))
    throw Error(Error::Kind::io, "Clients cannot be served at {}:{}: {}. Set another host or port.",
                settings.host, settings.port, take_message(error));
  port_ = g_inet_socket_address_get_port(G_INET_SOCKET_ADDRESS(bound));
  thread_ = std::thread([this] { accept(); });
}

ViewServer::~ViewServer() {
  g_cancellable_cancel(cancel_.get());
  thread_.join();
  g_socket_listener_close(socket_.get());
  // Their threads may still look through the others.
  std::vector<std::unique_ptr<ServedClient>> last;
  const std::scoped_lock lock(mutex_);
  last.swap(clients_);
}

void ViewServer::accept() {
  while (!g_cancellable_is_cancelled(cancel_.get())) {
    g_autoptr(GError) error = nullptr;
    Ref<GSocketConnection> connection(
        g_socket_listener_accept(socket_.get(), nullptr, cancel_.get(), &error));
    if (connection != nullptr) {
      try {
        welcome(std::move(connection));
      } catch (const std::exception& why) {  // no thread is to be had: others end meanwhile
        listener_("refused-resources", "A client", why.what());
        g_usleep(100'000);
      }
    } else if (!g_cancellable_is_cancelled(cancel_.get())) {
      g_usleep(100'000);  // out of file descriptors, or of memory: others end meanwhile
    }
  }
}

/// A connection has come.
void ViewServer::welcome(Ref<GSocketConnection> connection) {
  g_autoptr(GSocketAddress) from =
      g_socket_connection_get_remote_address(connection.get(), nullptr);
  if (!G_IS_INET_SOCKET_ADDRESS(from)) return;
  auto* inet = G_INET_SOCKET_ADDRESS(from);
  const std::string address = address_of(inet);
  if (!allowed_.has(g_inet_socket_address_get_address(inet))) {
    listener_("refused-addresses", address, "it is not in allow");
    return;
  }
  std::string network = network_of(g_inet_socket_address_get_address(inet));
  std::vector<std::unique_ptr<ServedClient>> removed;
  bool full = false;
  {
    const std::scoped_lock lock(mutex_);
    remove_ended(removed);
    // Without TLS nobody has to prove anything.
    const std::size_t taken = identity_ ? served() : clients_.size();
    full = taken >= settings_.max_clients;
    if (!full) {
      if (clients_.size() - taken >= most_handshakes) make_way(network, removed);
      ServedClient::Listener hears;
      if (said_) hears = [this, address](const std::string& line) { said_(address, line); };
      clients_.push_back(std::make_unique<ServedClient>(
          std::move(connection), ServedClient::From{address, std::move(network)}, identity_,
          seconds_of(settings_.timeout), [this](ServedClient& client) { return admit(client); },
          std::move(hears), head_));
    }
  }
  tell(removed);
  if (full) listener_("refused-full", address, {});
}

/// \p client has proved who it is: whether there is a place for it still.
bool ViewServer::admit(ServedClient& client) {
  {
    const std::scoped_lock lock(mutex_);
    if (client.ended() != ClientEnd::none || served() >= settings_.max_clients) return false;
    client.trust();
  }
  listener_("clients", client.address(), {});
  return true;
}

std::size_t ViewServer::served() const {
  return static_cast<std::size_t>(
      std::count_if(clients_.begin(), clients_.end(),
                    [](const auto& c) { return c->trusted() && c->ended() == ClientEnd::none; }));
}

/// Of those who are proving who they are, one more from \p network included, takes the first of the
/// network that has the most.
void ViewServer::make_way(const std::string& network,
                          std::vector<std::unique_ptr<ServedClient>>& removed) {
  std::map<std::string, std::size_t> counts{{network, 1}};
  for (const auto& client : clients_)
    if (!client->trusted()) ++counts[client->network()];
  auto given_up = clients_.end();
  for (auto each = clients_.begin(); each != clients_.end(); ++each)
    if (!(*each)->trusted() &&
        (given_up == clients_.end() || counts[(*each)->network()] > counts[(*given_up)->network()]))
      given_up = each;
  if (given_up == clients_.end()) return;
  (*given_up)->end(ClientEnd::late);
  removed.push_back(std::move(*given_up));
  clients_.erase(given_up);
}

/// Takes those that have ended, and those whose handshake takes too long.
void ViewServer::remove_ended(std::vector<std::unique_ptr<ServedClient>>& removed) {
  const std::int64_t oldest =
      g_get_monotonic_time() - 1'000'000 * std::int64_t{seconds_of(settings_.timeout)};
  for (auto& client : clients_) {
    if (!client->trusted() && client->since() < oldest) client->end(ClientEnd::late);
    client->look();
    if (client->ended() == ClientEnd::none) continue;
    bytes_ += client->bytes();
    removed.push_back(std::move(client));
  }
  std::erase(clients_, nullptr);
}

void ViewServer::tell(std::vector<std::unique_ptr<ServedClient>>& removed) {
  for (auto& client : removed) {
    const ClientEnd why = client->ended();
    const std::string address = client->address(), reason = client->reason();
    // Its thread has said by then that it came.
    client.reset();
    listener_(event_of(why), address, reason);
  }
}

void ViewServer::set_head(std::vector<Ref<GstBuffer>> head) {
  const std::scoped_lock lock(mutex_);
  head_ = std::move(head);
  for (const auto& client : clients_) client->begin_with(head_);
}

void ViewServer::send(GstBuffer* packet, const ViewServerSettings& settings) {
  std::vector<std::unique_ptr<ServedClient>> removed;
  {
    const std::scoped_lock lock(mutex_);
    settings_.max_clients = settings.max_clients;
    settings_.timeout = settings.timeout;
    for (const auto& client : clients_) client->send(packet, settings.buffers_max);
    remove_ended(removed);
  }
  tell(removed);
}

bool ViewServer::all_have_all() const {
  const std::scoped_lock lock(mutex_);
  return std::all_of(clients_.begin(), clients_.end(), [](const auto& c) {
    c->look();  // who has gone acknowledges nothing any more
    return c->has_all();
  });
}

std::size_t ViewServer::clients() const {
  const std::scoped_lock lock(mutex_);
  return served();
}

std::uint64_t ViewServer::bytes() const {
  const std::scoped_lock lock(mutex_);
  std::uint64_t sum = bytes_;
  for (const auto& client : clients_) sum += client->bytes();
  return sum;
}

}  // namespace polyhull::element
