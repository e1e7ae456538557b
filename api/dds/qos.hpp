#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <dds/dds.h>

#include "shm/base/time.hpp"

namespace plchost::dds {

/// A quality-of-service description, built by naming what differs from DDS's defaults.
class Qos {
 public:
  Qos() : qos_(dds_create_qos()) {}

  Qos& reliable(Duration max_blocking);
  Qos& best_effort();
  Qos& keep_last(std::int32_t depth);
  Qos& keep_all();
  Qos& transient_local();
  Qos& max_samples(std::int32_t samples);
  Qos& deadline(Duration period);
  Qos& partition(const std::string& name);
  Qos& user_data(std::string_view text);
  /// A writer that ends says nothing of its instances: "deleted" and "server gone" stay apart.
  Qos& no_autodispose();

  [[nodiscard]] const dds_qos_t* get() const noexcept { return qos_.get(); }

 private:
  struct Deleter {
    void operator()(dds_qos_t* qos) const noexcept { dds_delete_qos(qos); }
  };
  std::unique_ptr<dds_qos_t, Deleter> qos_;
};

}  // namespace plchost::dds
