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
  /// @param network  where it comes from; make_room() limits the connections of each network.
  explicit WebConnection(std::string network) : network_(std::move(network)) {}
  virtual ~WebConnection() = default;
  WebConnection(const WebConnection&) = delete;
  WebConnection& operator=(const WebConnection&) = delete;

  virtual void start() = 0;
  virtual void close() = 0;
  /// Something is new, or the server ends.
  virtual void wake() = 0;

  [[nodiscard]] const std::string& network() const { return network_; }
  [[nodiscard]] bool watches() const { return watches_; }

 protected:
  bool watches_ = false;

 private:
  std::string network_;
};

/// The clients, and their shared state.
class WebConnections {
 public:
  WebPage* page = nullptr;                ///< the page served to the clients
  std::atomic<std::size_t> watchers = 0;  ///< browsers that watch; read by other threads too
  bool stopping = false;                  ///< the server ends

  void add(std::shared_ptr<WebConnection> connection);
  void remove(const WebConnection* connection);
  void clear() { all_.clear(); }
  void wake_all();

  /// Makes room for one more connection of a network: the oldest of this network, or of the network
  /// with most connections, is closed, unless it watches.
  /// @return false where there is none to be had.
  [[nodiscard]] bool make_room(const std::string& network);

 private:
  [[nodiscard]] std::size_t count_of(const std::string& network) const;
  bool close_oldest(const std::string& network);

  std::list<std::shared_ptr<WebConnection>> all_;  // in the order of their coming
};

}  // namespace axiscal
