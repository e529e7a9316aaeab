// Reads a topic with Fast DDS, which is ROS 2's other middleware: fastdds_reader DOMAIN TOPIC TYPE SECONDS prints each message's bytes in
// hexadecimal, and ends after the first three.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

/// Any type, as bytes.
class Bytes : public TopicDataType {
 public:
  explicit Bytes(const char* name) {
    setName(name);
    m_typeSize = 1 << 20;
    m_isGetKeyDefined = false;
  }
  bool serialize(void*, SerializedPayload_t*) override { return false; }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    auto& bytes = *static_cast<std::vector<unsigned char>*>(data);
    bytes.assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void*) override {
    return [] { return 0U; };
  }
  void* createData() override { return new std::vector<unsigned char>; }
  void deleteData(void* data) override { delete static_cast<std::vector<unsigned char>*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  DomainParticipant* participant = DomainParticipantFactory::get_instance()->create_participant(
      static_cast<unsigned>(std::atoi(argv[1])), PARTICIPANT_QOS_DEFAULT);
  TypeSupport type(new Bytes(argv[3]));
  type.register_type(participant);
  Topic* topic = participant->create_topic(argv[2], argv[3], TOPIC_QOS_DEFAULT);
  Subscriber* subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  DataReaderQos qos = DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = BEST_EFFORT_RELIABILITY_QOS;
  qos.history().depth = 100;
  DataReader* reader = subscriber->create_datareader(topic, qos);
  int seen = 0;
  for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(std::atoi(argv[4]));
       seen < 3 && std::chrono::steady_clock::now() < until;
       std::this_thread::sleep_for(std::chrono::milliseconds(2))) {
    std::vector<unsigned char> bytes;
    SampleInfo info;
    while (seen < 3 && reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      for (const unsigned char byte : bytes) std::printf("%02x", byte);
      std::printf("\n");
      ++seen;
    }
  }
  std::fflush(stdout);
  std::_Exit(seen == 3 ? 0 : 1);
}
