#pragma once

/// The machine that this example would control if there was one: a bottle on a scale below a two-stage valve.
/// The flow follows the valve with a lag, so some product still arrives after closing: the after-run.
class FillingStation {
 public:
  void step(double seconds, bool coarse_valve, bool fine_valve) {
    const double wanted = coarse_valve ? kCoarseFlow : fine_valve ? kFineFlow : 0.0;
    flow_ += (wanted - flow_) * seconds / kValveLag;
    weight_ += flow_ * seconds;
  }
  void place_empty_bottle() { weight_ = 0.0; }
  [[nodiscard]] double weight() const { return weight_; }

 private:
  static constexpr double kCoarseFlow = 800.0;  // g/s
  static constexpr double kFineFlow = 100.0;    // g/s
  static constexpr double kValveLag = 0.06;     // s
  double flow_ = 0.0;
  double weight_ = 0.0;
};
