#ifndef FLAPPY_CONTROLLER_TYPES
#define FLAPPY_CONTROLLER_TYPES 1

typedef struct {
  float x, y, z;
} flappy_vector;

typedef struct {
  float w, x, y, z; /* turns B into W, of length 1 */
} flappy_quaternion;

#endif
