#include "gap/diagnose/diagnosis_files.hpp"

#include "io/files.hpp"

namespace flappy::gap {
namespace {

std::string digits(const std::optional<double>& value) { return value ? io::shortest_digits(*value) : ""; }
std::string digits(double value) { return io::shortest_digits(value); }

}  // namespace

void write_tables(const std::filesystem::path& folder, const Report& r) {
  std::string places = "stage,test,channel,regime,gap,noise_floor,unit,p_value,discovered\n";
  for (const GapLocation& p : r.places)
    places += p.stage + "," + p.test + "," + channel_name(p.channel) + "," + p.regime + "," + digits(p.gap) + "," +
              digits(p.noise_floor) + "," + channel_unit(p.channel) + "," + digits(p.p_value) + "," +
              (p.discovered ? "1" : "0") + "\n";
  io::write_atomically(folder / "residuals.csv", places);

  std::string candidates =
      "rank,kind,effects,group,probability,log_evidence,loss,closure,closure_low,closure_high,parameter,value,low,high,"
      "unit\n";
  for (std::size_t i = 0; i < r.candidates.size(); ++i) {
    const Reported& c = r.candidates[i];
    const std::string first =
        std::to_string(i + 1) + "," + kind_name(c.kind) + "," + io::joined(c.effects, "+") + "," + c.group + "," +
        digits(c.probability) + "," + digits(c.log_evidence) + "," + digits(c.loss) + "," +
        (c.closure ? digits(c.closure->value) + "," + digits(c.closure->low) + "," + digits(c.closure->high)
                   : std::string(",,")) +
        ",";
    if (c.sizes.empty()) candidates += first + ",,,,\n";
    for (const SizeEstimate& s : c.sizes)
      candidates +=
          first + s.name + "," + digits(s.value) + "," + digits(s.low) + "," + digits(s.high) + "," + s.unit + "\n";
  }
  io::write_atomically(folder / "candidates.csv", candidates);

  std::string terms = "jointly_with,channel,harmonic,function,times_usual,gain_nats\n";
  for (const Unexplained& u : r.unexplained)
    terms += io::joined(r.jointly_with, "+") + "," + u.channel + "," + u.harmonic + "," + u.function + "," +
             digits(u.times) + "," + digits(u.gain) + "\n";
  io::write_atomically(folder / "unexplained.csv", terms);
}

}  // namespace flappy::gap
