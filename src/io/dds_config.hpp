// The table [dds] of a configuration: whether a program speaks to others over DDS, and to whom.
//
//   enabled = false
//   domain = 0                  ROS_DOMAIN_ID
//   reach = "loopback"          who finds us: "loopback" (those that look on this machine alone), "host" (whoever is on this
//                               machine, however it looks), "network"
//   peers = ["192.0.2.7"]       machines that are asked by address, where multicast does not reach; reach = "network" alone
//   config = "own"              or "environment": CYCLONEDDS_URI alone says how
//   namespace = "flappy"        /flappy/pose and so on; of the second flapper that is watched, /flappy_1/pose
//   watch = [0]                 numbers of the flappers that are shown
//   pace = 1.0                  flappy-fly: times real time; 0: as fast as it flies
//   commands = false            whether others may steer
//   insecure = false            commands over a network from anybody; otherwise that takes `keys`
//   keys = "folder"             of DDS Security: identity_ca.cert.pem, cert.pem, key.pem, permissions_ca.cert.pem, governance.p7s,
//                               permissions.p7s, as an enclave of ROS 2 has them
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "io/config.hpp"

namespace flappy::io {

enum class Reach { loopback, host, network };

struct DdsConfig {
  bool enabled = false;
  int domain = 0;
  Reach reach = Reach::loopback;
  bool from_environment = false;
  std::vector<std::string> peers;
  std::string name_space = "flappy";
  std::vector<std::uint32_t> watch = {0};
  double pace = 1;
  bool commands = false, insecure = false;
  std::filesystem::path keys;  ///< empty: no security
};

inline constexpr std::size_t kMostWatched = 64;

/// Of the table `dds` of a configuration; as above where there is none. InputError for what is not accepted.
DdsConfig read_dds_config(const Table& root);

}  // namespace flappy::io
