// Publishes lines on a ROS 2 topic by Fast DDS, as rmw_fastrtps does: publisher DOMAIN TOPIC LINE ...
// Built with -lfastrtps -lfastcdr (Debian's libfastrtps-dev and libfastcdr-dev). Ends with 0 once a reader has acknowledged all.

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace cdr = eprosima::fastcdr;

/// std_msgs/msg/String, of which no description is sent along.
class Text : public fast::TopicDataType {
public:
    Text() {
        setName("std_msgs::msg::dds_::String_");
        m_typeSize = 65000;
        auto_fill_type_object(false);
        auto_fill_type_information(false);
    }

    bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
        cdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->max_size);
        cdr::Cdr writer(buffer, cdr::Cdr::DEFAULT_ENDIAN, cdr::Cdr::DDS_CDR);
        payload->encapsulation = CDR_LE;
        writer.serialize_encapsulation();
        writer << *static_cast<std::string*>(data);
        payload->length = static_cast<uint32_t>(writer.getSerializedDataLength());
        return true;
    }

    bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }

    std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
        return [data] { return static_cast<uint32_t>(static_cast<std::string*>(data)->size() + 9); };
    }

    void* createData() override { return new std::string; }
    void deleteData(void* data) override { delete static_cast<std::string*>(data); }
    bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

int main(int count, char** given) {
    if (count < 3) return 2;
    auto* participant =
        fast::DomainParticipantFactory::get_instance()->create_participant(std::atoi(given[1]), fast::PARTICIPANT_QOS_DEFAULT);
    fast::TypeSupport text(new Text);
    text.register_type(participant);
    auto* topic = participant->create_topic(std::string("rt") + given[2], text.get_type_name(), fast::TOPIC_QOS_DEFAULT);
    fast::DataWriterQos asked = fast::DATAWRITER_QOS_DEFAULT;
    asked.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    asked.history().kind = fast::KEEP_ALL_HISTORY_QOS;
    asked.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto* writer = participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, asked);
    fast::PublicationMatchedStatus matched;
    for (int i = 0; i < 100 && matched.current_count == 0; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        writer->get_publication_matched_status(matched);
    }
    for (int i = 3; i < count; ++i) {
        std::string line = given[i];
        writer->write(&line);
    }
    bool heard = matched.current_count > 0 && writer->wait_for_acknowledgments({10, 0}) == ReturnCode_t::RETCODE_OK;
    std::cout << (heard ? "heard" : "not heard") << std::endl;
    return heard ? 0 : 1;
}
