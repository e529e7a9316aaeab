#include "gap/diagnose/diagnosis_files.hpp"

#include <algorithm>

#include "io/files.hpp"
#include "io/gnuplot.hpp"

namespace flappy::gap {
namespace {

constexpr std::size_t kMostBars = 10;
constexpr const char* kColours[] = {"#bdbdbd", "#6baed6", "#08519c"};

std::string digits(const std::optional<double>& value) { return value ? io::shortest_digits(*value) : ""; }
std::string digits(double value) { return io::shortest_digits(value); }

void draw(const std::filesystem::path& folder, const std::string& name, const std::string& script) {
  io::draw_svg(folder / (name + ".svg"), name, 760, 420, script);
}

/// Residual over noise by channel: a group of bars for each, one for each stage.
std::string residual_script(const Report& r) {
  const std::size_t stages = r.effect ? 3 : 2;
  std::string script =
      "set grid ytics lc '#dddddd' lt 1\nset key outside top center horizontal\nset style fill solid\n"
      "set style data histogram\nset style histogram clustered gap 1\nset boxwidth 0.9\nset logscale "
      "y\nset yrange [0.5:*]\n"
      "set ylabel 'rms of residual over noise'\nset xtics rotate by -40\n$rows << end_of_rows\n";
  for (std::size_t channel = 0; channel < kChannels; ++channel) {
    if (!(r.over_noise[0][channel] > 0)) continue;
    script += channel_name(static_cast<int>(channel));
    for (std::size_t s = 0; s < stages; ++s) script += " " + digits(r.over_noise[s][channel]);
    script += "\n";
  }
  script += "end_of_rows\nplot ";
  const char* const titles[] = {"nominal", "parameters refitted", "with the best effect"};
  for (std::size_t s = 0; s < stages; ++s)
    script += std::string(s == 0 ? "" : ", ") + "$rows using " + std::to_string(s + 2) + ":xtic(strcol(1)) lc '" +
              kColours[s] + "' title '" + titles[s] + "'";
  return script + ", 1 with lines lc '#a63603' title 'noise alone'\n";
}

/// Probabilities of the top hypotheses, the largest above.
std::string probability_script(const Report& r) {
  std::vector<const Reported*> top;
  for (const Reported& c : r.candidates) top.push_back(&c);
  std::ranges::stable_sort(top, std::greater{}, &Reported::probability);
  if (top.size() > kMostBars) top.resize(kMostBars);
  std::string script =
      "set grid xtics lc '#dddddd' lt 1\nset style fill solid\nset xrange [0:1]\nunset key\n"
      "set xlabel 'probability'\nset yrange [-0.6:" +
      digits(static_cast<double>(top.size()) - 0.4) + "]\n$rows << end_of_rows\n";
  for (std::size_t i = 0; i < top.size(); ++i) {
    const bool effect = top[i]->kind == ScoredHypothesis::Kind::effect;
    script += digits(static_cast<double>(top.size() - 1 - i)) + " " + digits(top[i]->probability) + " \"" +
              (effect ? io::joined(top[i]->effects) : "(" + top[i]->group + ")") + "\"\n";
  }
  return script +
         "end_of_rows\nplot $rows using (column(2)/2):1:(column(2)/2):(0.35):ytic(strcol(3)) with boxxyerror lc '" +
         kColours[2] + "'\n";
}

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

void write_figures(const std::filesystem::path& folder, const Report& r) {
  draw(folder, "residuals", residual_script(r));
  draw(folder, "probabilities", probability_script(r));
}

}  // namespace flappy::gap
