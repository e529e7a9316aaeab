// Domains of a test's own, and the configurations with which ROS 2 looks for others.
#pragma once

#include <unistd.h>

#include "refusal.hpp"
#include "server/dds/participant.hpp"

namespace flappy::server {

/// Of the 233 domains, one that no other test uses at this time; the first hundred are left to people.
inline int own_domain() {
  static int count = 0;
  return 100 + (getpid() * 7 + count++) % 130;
}

inline io::DdsConfig loopback(int domain) {
  io::DdsConfig c;
  c.enabled = true;
  c.domain = domain;
  return c;
}

/// What rmw_cyclonedds_cpp tells Cyclone DDS, by its source: Humble with ROS_LOCALHOST_ONLY=1 and without; Jazzy with
/// ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST and without.
inline constexpr const char* kHumbleLocalhost =
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address=\"127.0.0.1\"/></Interfaces></General></Domain>"
    "</CycloneDDS>";
inline constexpr const char* kHumble = "";
inline constexpr const char* kJazzyLocalhost =
    "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto"
    "</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex><Peers><Peer "
    "address=\"localhost\"/></Peers>"
    "</Discovery></Domain></CycloneDDS>";
inline constexpr const char* kJazzy =
    "<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32"
    "</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>";

}  // namespace flappy::server
