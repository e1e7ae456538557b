#include "api/client/control_client.hpp"

#include "api/client/client_core_status.hpp"

namespace plchost {

Result<std::unique_ptr<ControlClient>> ControlClient::connect(const dds::DomainOptions& options,
                                                              std::string_view only) {
  PLCHOST_TRY_ASSIGN(auto entered, enter_domain(options));
  return connect(std::move(entered), only);
}

Result<std::unique_ptr<ControlClient>> ControlClient::connect(std::shared_ptr<Participant> participant,
                                                              std::string_view only) {
  PLCHOST_TRY_ASSIGN(auto core, ClientCore::connect(std::move(participant), only));
  return std::unique_ptr<ControlClient>(new ControlClient(std::move(core)));
}

std::vector<HostView> ControlClient::hosts(TimePoint deadline) {
  return wait(core_->hosts(deadline));
}

std::vector<HostView> ControlClient::known_hosts(TimePoint deadline) {
  return wait(core_->known_hosts(deadline));
}

Result<ClockOffset> ControlClient::clock_offset(const std::string& host, TimePoint deadline) {
  return wait(core_->clock_offset(host, deadline));
}

Result<HostView> ControlClient::host(std::string_view name, TimePoint deadline) {
  return wait(core_->host(std::string(name), deadline));
}

bool ControlClient::is_silent(std::string_view host) {
  return core_->is_silent(host);
}

Result<std::vector<plc_InstanceStatus>> ControlClient::instances(const std::string& host,
                                                                 TimePoint deadline) {
  return status<plc_InstanceStatus>(host, deadline);
}

Result<std::vector<plc_TaskStatus>> ControlClient::tasks(const std::string& host, TimePoint deadline) {
  return status<plc_TaskStatus>(host, deadline);
}

Result<StatisticsReport> ControlClient::statistics(const std::string& host, std::string_view instance,
                                                   std::string_view task, TimePoint deadline) {
  return wait(core_->statistics(host, std::string(instance), std::string(task), deadline));
}

Result<std::vector<plc_EventStatus>> ControlClient::events(const std::string& host, TimePoint deadline) {
  return status<plc_EventStatus>(host, deadline);
}

Result<std::vector<plc_WriterStatus>> ControlClient::writers(const std::string& host, TimePoint deadline) {
  return status<plc_WriterStatus>(host, deadline);
}

Result<std::vector<plc_ExceptionStatus>> ControlClient::exceptions(const std::string& host,
                                                                   TimePoint deadline) {
  return status<plc_ExceptionStatus>(host, deadline);
}

Result<std::vector<plc_ApplicationStatus>> ControlClient::applications(const std::string& host,
                                                                       TimePoint deadline) {
  return status<plc_ApplicationStatus>(host, deadline);
}

Result<ObjectListing> ControlClient::list_objects(const std::string& host, const ObjectQuery& query,
                                                  TimePoint deadline) {
  return wait(core_->list_objects(host, query, deadline));
}

Result<NodesTold> ControlClient::list_nodes(const std::string& host, const NodeQuery& query,
                                            TimePoint deadline) {
  return wait(core_->list_nodes(host, query, deadline));
}

Result<NodesTold> ControlClient::list_routes(const std::string& host, const NodeQuery& query,
                                             TimePoint deadline) {
  return wait(core_->list_routes(host, query, deadline));
}

Result<LogListing> ControlClient::read_log(const std::string& host, const std::string& instance,
                                           const LogQuery& query, TimePoint deadline) {
  return wait(core_->read_log(host, instance, query, deadline));
}

Result<VariableListing> ControlClient::list_variables(const std::string& host, const std::string& instance,
                                                      const VariableQuery& query, TimePoint deadline) {
  return wait(core_->list_variables(host, instance, query, deadline));
}

Result<DebugPart> ControlClient::read_debug(const std::string& host, const std::string& instance,
                                            const DebugQuery& query, TimePoint deadline) {
  return wait(core_->read_debug(host, instance, query, deadline));
}

Result<std::vector<plc_HostFinding>> ControlClient::check_host(const std::string& host, TimePoint deadline) {
  return wait(core_->check_host(host, deadline));
}

Result<std::vector<TransitionView>> ControlClient::transitions() {
  return core_->transitions();
}

Result<bool> ControlClient::has_all_transitions(const std::string& host, TimePoint deadline) {
  return wait(core_->has_all_transitions(host, deadline));
}

Result<ApiReply> ControlClient::call(const ApiRequest& request, TimePoint deadline) {
  return wait(core_->call(request, deadline));
}

Result<ApiReply> ControlClient::download(const Download& download, const DownloadProgressFunction& progress,
                                         TimePoint deadline) {
  return wait(core_->download(download, progress, deadline));
}

Result<void> ControlClient::prepare_posts(const std::string& host, TimePoint deadline) {
  return wait(core_->prepare_posts(host, deadline));
}

Result<PostReport> ControlClient::post_event(const HostEvent& event, std::uint64_t count, Duration interval,
                                             Duration patience, const std::function<bool()>& stop) {
  return wait(core_->post_event(event, count, interval, patience, stop));
}

Result<RunReport> ControlClient::post_and_await(const HostEvent& event, Duration patience) {
  return wait(core_->post_and_await(event, patience));
}

Result<PostReport> ControlClient::post_batch(const std::string& host, std::span<const EventId> events,
                                             Duration patience) {
  return wait(core_->post_batch(host, {events.begin(), events.end()}, patience));
}

Result<void> ControlClient::post_one(const std::string& host, std::string_view instance,
                                     std::string_view event, Duration patience) {
  return core_->post_one(host, instance, event, patience);
}

std::uint64_t ControlClient::changes() {
  return core_->changes();
}

TimePoint ControlClient::next_silence() const {
  return core_->next_silence();
}

}  // namespace plchost
