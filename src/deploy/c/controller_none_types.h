/* No feedback controller: the policy, or whoever flies in its place, does all. */
typedef struct {
  float none;
} flappy_feedback_constants;

typedef struct {
  float none;
} flappy_feedback;
