#include "api/client/request_caller.hpp"

namespace plchost {

Result<RequestCaller> RequestCaller::create(dds_entity_t participant, dds_entity_t topic,
                                            const std::string& host) {
  RequestCaller caller;
  PLCHOST_TRY_ASSIGN(caller.way_, dds::open_writer(participant, dds::host_partition(host), topic,
                                                   dds::qos_of(dds::kOperatorRequest)));
  caller.guid_ = dds::guid_of(caller.way_.writer.get());
  return caller;
}

void RequestCaller::number(plc_Request& request) noexcept {
  guid_.copy_to(request.header.request_identity.writer_guid);
  request.header.request_identity.sequence_number = ++last_number_;
}

void RequestCaller::write(const plc_Request& request) const noexcept {
  (void)dds_write(way_.writer.get(), &request);  // a refusal of DDS is mended by the repetition
}

}  // namespace plchost
