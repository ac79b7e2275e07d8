/** What WebGL runs to draw a mesh: as an outline, a shaded shape, in colours of depth agreement, or in its own. */

export const SHAPE_VERTEX = `#version 300 es
uniform mat4 cameraFromObject;
uniform mat4 projection;
in vec3 position;
out vec3 place;
void main() {
  vec4 inCamera = cameraFromObject * vec4(position, 1.0);
  place = inCamera.xyz;
  gl_Position = projection * inCamera;
}`;

// Red is how much light comes back to the camera from a flat face, alpha how much of the pixel is covered. Green and
// blue are what the depth image says there: (0, 0) nothing, (1, 0) a match, (0, 1) and (1, 1) that the face is in
// front of, or behind, what was measured, as registration_core's depth_agreement judges it.
export const SHAPE_FRAGMENT = `#version 300 es
precision highp float;
uniform highp usampler2D measured;
uniform vec4 sensor;
uniform float unitOfDepth;
uniform float tolerance;
in vec3 place;
out vec4 painted;
vec2 verdict() {
  ivec2 pixel = ivec2(floor(sensor.xy * place.xy / place.z + sensor.zw + 0.5));
  ivec2 size = textureSize(measured, 0);
  if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) return vec2(0.0);
  float depth = unitOfDepth * float(texelFetch(measured, pixel, 0).r);
  if (depth == 0.0) return vec2(0.0);
  float most = tolerance * pow(max(place.z, 1.0), 2.0);
  if (depth - place.z > most) return vec2(0.0, 1.0);
  return place.z - depth > most ? vec2(1.0, 1.0) : vec2(1.0, 0.0);
}
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float light = 0.3 + 0.7 * abs(dot(normal, normalize(place)));
  painted = vec4(light, verdict(), 1.0);
}`;

export const WHOLE_VERTEX = `#version 300 es
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

// The line lies inside the edge of the shape, so that the edge itself is where colour meets dark: a dark rim on
// either side lets it be read on any ground. Shrinking and growing the shape is a minimum and a maximum over
// discs. Far from the edge nothing needs to be looked for: there the blocks of pixels around are all of one kind.
export const OUTLINE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D shape;
uniform ivec2 size;
uniform vec3 color;
uniform float blend;
uniform float unit;
uniform bool isJudged;
uniform vec3 verdicts[4];
out vec4 painted;
const float LINE = 2.5, RIM = 1.5;
const float STRIPES = 7.0, STRIPE = 2.0;
float cover(int x, int y, int level) {
  ivec2 there = clamp(ivec2(gl_FragCoord.xy) + ivec2(x, y), ivec2(0), size - 1);
  return texelFetch(shape, there >> level, level).a;
}
// Stripes lean to either side, so that the verdicts can be told apart without their colours.
vec4 judged(vec4 seen) {
  vec2 says = seen.gb / max(seen.a, 0.001);
  vec3 hue = mix(mix(verdicts[0], verdicts[1], says.x), mix(verdicts[2], verdicts[3], says.x), says.y);
  float along = says.x > 0.5 ? gl_FragCoord.x + gl_FragCoord.y : gl_FragCoord.x - gl_FragCoord.y;
  float stripe = says.y > 0.5 && mod(along / unit, STRIPES) < STRIPE ? 0.25 : 1.0;
  float opacity = seen.a * mix(0.45, 0.85, max(says.x, says.y));
  return opacity * vec4(hue * stripe * (0.6 + 0.4 * seen.r / max(seen.a, 0.001)), 1.0);
}
void main() {
  vec4 seen = texelFetch(shape, ivec2(gl_FragCoord.xy), 0);
  painted = isJudged ? judged(seen) : blend * vec4(color * seen.r, seen.a);
  int reach = int(ceil((LINE + RIM) * unit));
  int level = reach > 4 ? 4 : 3;
  float around = cover(-reach, -reach, level) + cover(reach, -reach, level) + cover(-reach, reach, level)
    + cover(reach, reach, level);
  if (around == 0.0 || around == 4.0) return;
  float grown = seen.a, withoutLine = seen.a, withoutRim = seen.a;
  for (int y = -reach; y <= reach; y++) {
    for (int x = -reach; x <= reach; x++) {
      float near = cover(x, y, 0);
      float away = length(vec2(x, y)) - 0.5;
      grown = max(grown, near * clamp(RIM * unit - away, 0.0, 1.0));
      withoutLine = min(withoutLine, mix(1.0, near, clamp(LINE * unit - away, 0.0, 1.0)));
      withoutRim = min(withoutRim, mix(1.0, near, clamp((LINE + RIM) * unit - away, 0.0, 1.0)));
    }
  }
  float rim = 0.75 * (grown - seen.a) + 0.4 * (withoutLine - withoutRim);
  float line = seen.a - withoutLine;
  painted = painted * (1.0 - rim) + vec4(0.0, 0.0, 0.0, rim);
  painted = painted * (1.0 - line) + vec4(color * line, line);
}`;

export const TEXTURED_VERTEX = `#version 300 es
uniform mat4 cameraFromObject;
uniform mat4 projection;
in vec3 position;
in vec4 color;
in vec2 place;
out vec3 inCamera;
out vec3 ownColor;
out vec2 inPicture;
void main() {
  inCamera = (cameraFromObject * vec4(position, 1.0)).xyz;
  ownColor = color.rgb;
  inPicture = place;
  gl_Position = projection * vec4(inCamera, 1.0);
}`;

export const TEXTURED_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform bool hasPicture;
in vec3 inCamera;
in vec3 ownColor;
in vec2 inPicture;
out vec4 painted;
void main() {
  vec3 normal = normalize(cross(dFdx(inCamera), dFdy(inCamera)));
  float light = 0.5 + 0.5 * abs(dot(normal, normalize(inCamera)));
  painted = vec4(light * (hasPicture ? texture(picture, inPicture).rgb : ownColor), 1.0);
}`;
