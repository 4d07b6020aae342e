// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <list>
#include <memory>
#include <string>
#include <utility>

#include "acquisition/src/web_page.hpp"

namespace axiscal {

/// One client of the page. All of its functions run in the server's thread.
class WebConnection {
 public:
  /// @param network  network of the client; make_room() limits the connections of each network.
  explicit WebConnection(std::string network) : network_(std::move(network)) {}
  virtual ~WebConnection() = default;
  WebConnection(const WebConnection&) = delete;
  WebConnection& operator=(const WebConnection&) = delete;

  virtual void start() = 0;
  virtual void close() = 0;
  /// Must be called when there are new data, and when the server ends.
  virtual void wake() = 0;

  [[nodiscard]] const std::string& network() const { return network_; }
  [[nodiscard]] bool watches() const { return watches_; }

 protected:
  bool watches_ = false;

 private:
  std::string network_;
};

/// All clients and their shared state.
class WebConnections {
 public:
  WebPage* page = nullptr;                ///< the page served to the clients
  std::atomic<std::size_t> watchers = 0;  ///< number of watching browsers; several threads read it
  bool stopping = false;                  ///< true if the server is ending

  void add(std::shared_ptr<WebConnection> connection);
  void remove(const WebConnection* connection);
  void clear() { all_.clear(); }
  void wake_all();

  /// Makes room for one more connection from a network. If this network has too many connections,
  /// its oldest connection is closed. If all networks together have too many, the oldest connection
  /// of the network with the most connections is closed. Watching browsers stay connected.
  /// @return false if no connection can be closed.
  [[nodiscard]] bool make_room(const std::string& network);

 private:
  [[nodiscard]] std::size_t count_of(const std::string& network) const;
  bool close_oldest(const std::string& network);

  std::list<std::shared_ptr<WebConnection>> all_;  // oldest first
};

}  // namespace axiscal
