// A Fast DDS peer: subscribes to the clock and the description, drives, and prints what it received as JSON.
// Arguments: the domain, and the number of seconds to drive.

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include "MessagesPubSubTypes.h"

using namespace eprosima::fastdds::dds;
using eprosima::fastdds::rtps::UDPv4TransportDescriptor;

int main(int, char **argv) {
  DomainParticipantQos qos;
  qos.name("fastdds_peer");
  // on this machine only, like the bridge
  auto transport = std::make_shared<UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  eprosima::fastrtps::rtps::Locator_t here;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(here, "127.0.0.1");
  qos.wire_protocol().builtin.initialPeersList.push_back(here);
  auto *participant =
      DomainParticipantFactory::get_instance()->create_participant(std::atoi(argv[1]), qos);
  if (participant == nullptr) return 2;

  TypeSupport clock_type(new rosgraph_msgs::msg::dds_::Clock_PubSubType());
  TypeSupport string_type(new std_msgs::msg::dds_::String_PubSubType());
  TypeSupport twist_type(new geometry_msgs::msg::dds_::Twist_PubSubType());
  for (auto &type : {clock_type, string_type, twist_type}) participant->register_type(type);
  auto *clock_topic =
      participant->create_topic("rt/clock", clock_type.get_type_name(), TOPIC_QOS_DEFAULT);
  auto *string_topic = participant->create_topic("rt/robot_description", string_type.get_type_name(),
                                                 TOPIC_QOS_DEFAULT);
  auto *twist_topic =
      participant->create_topic("rt/cmd_vel", twist_type.get_type_name(), TOPIC_QOS_DEFAULT);

  auto *subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  auto *clock = subscriber->create_datareader(clock_topic, DATAREADER_QOS_DEFAULT);
  DataReaderQos latched = DATAREADER_QOS_DEFAULT;
  latched.reliability().kind = RELIABLE_RELIABILITY_QOS;
  latched.durability().kind = TRANSIENT_LOCAL_DURABILITY_QOS;
  auto *description = subscriber->create_datareader(string_topic, latched);
  auto *writer = participant->create_publisher(PUBLISHER_QOS_DEFAULT)
                     ->create_datawriter(twist_topic, DATAWRITER_QOS_DEFAULT);

  geometry_msgs::msg::dds_::Twist_ twist;
  twist.linear().x(0.2);
  rosgraph_msgs::msg::dds_::Clock_ time;
  std_msgs::msg::dds_::String_ text;
  SampleInfo info;
  int clocks = 0;
  double seconds = 0.0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[2]));
  while (std::chrono::steady_clock::now() < end) {
    writer->write(&twist);
    while (clock->take_next_sample(&time, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      ++clocks;
      seconds = time.clock().sec() + 1e-9 * time.clock().nanosec();
    }
    description->take_next_sample(&text, &info);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  std::cout << "{\"clocks\": " << clocks << ", \"seconds\": " << seconds
            << ", \"description\": " << text.data().size() << "}" << std::endl;
  participant->delete_contained_entities();
  DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
