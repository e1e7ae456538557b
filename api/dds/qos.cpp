#include "api/dds/qos.hpp"

namespace plchost::dds {

Qos& Qos::reliable(Duration max_blocking) {
  dds_qset_reliability(qos_.get(), DDS_RELIABILITY_RELIABLE, max_blocking.count());
  return *this;
}

Qos& Qos::best_effort() {
  dds_qset_reliability(qos_.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  return *this;
}

Qos& Qos::keep_last(std::int32_t depth) {
  dds_qset_history(qos_.get(), DDS_HISTORY_KEEP_LAST, depth);
  // The history of a transient-local writer for late readers has a bound of its own.
  dds_qset_durability_service(qos_.get(), 0, DDS_HISTORY_KEEP_LAST, depth, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return *this;
}

Qos& Qos::keep_all() {
  dds_qset_history(qos_.get(), DDS_HISTORY_KEEP_ALL, 0);
  return *this;
}

Qos& Qos::transient_local() {
  dds_qset_durability(qos_.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  return *this;
}

Qos& Qos::max_samples(std::int32_t samples) {
  dds_qset_resource_limits(qos_.get(), samples, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  return *this;
}

Qos& Qos::deadline(Duration period) {
  dds_qset_deadline(qos_.get(), period.count());
  return *this;
}

Qos& Qos::partition(const std::string& name) {
  dds_qset_partition1(qos_.get(), name.c_str());
  return *this;
}

Qos& Qos::user_data(std::string_view text) {
  dds_qset_userdata(qos_.get(), text.data(), text.size());
  return *this;
}

Qos& Qos::no_autodispose() {
  dds_qset_writer_data_lifecycle(qos_.get(), false);
  return *this;
}

}  // namespace plchost::dds
