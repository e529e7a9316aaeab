// The table [dds] of a configuration: whether a program communicates over DDS, and with whom.
//
//   enabled = false
//   domain = 0              ROS_DOMAIN_ID
//   reach = "loopback"      who discovers us: "loopback" (programs here that search it), "host" (all here), "network"
//   peers = ["192.0.2.7"]   machines to contact by address, where multicast does not reach them; only for "network"
//   config = "own"          or "environment": CYCLONEDDS_URI configures DDS
//   namespace = "flappy"    gives /flappy/pose and so on; /flappy_1/pose for the second watched flapper
//   watch = [0]             numbers of the flappers that are published
//   pace = 1.0              for flappy-fly: simulated time over real time; 0: as fast as possible
//   commands = false        whether commands from others are accepted
//   insecure = false        whether to accept commands over a network without `keys`
//   keys = "folder"         for DDS Security, like an enclave of ROS 2: identity_ca.cert.pem, cert.pem, key.pem,
//                           permissions_ca.cert.pem, governance.p7s, permissions.p7s
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

inline constexpr std::size_t kMaxWatched = 64;

/// Reads the table `dds`; defaults where it is missing. Throws InputError for values that are not accepted.
DdsConfig read_dds_config(const Table& root);

}  // namespace flappy::io
