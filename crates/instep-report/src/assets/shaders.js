// GLSL. Colours are linear inside and become sRGB in `show`; output is premultiplied, over the page's own background.
const shaders = (() => {
  const head = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
`;
  const placed = `
layout(location = 0) in vec4 aPosition; // unit shape, w: which cap
layout(location = 1) in vec3 aNormal;
uniform vec3 uPosition; uniform vec4 uRotation /* x y z w */; uniform vec3 uSize; uniform float uHalf;
vec3 turned(vec3 v) { return v + 2.0 * cross(uRotation.xyz, cross(uRotation.xyz, v) + uRotation.w * v); }
vec3 placed() { return uPosition + turned(aPosition.xyz * uSize + vec3(0.0, 0.0, aPosition.w * uHalf)); }
`;
  const light = `
uniform mat4 uLight; uniform vec3 uSun, uSunColor, uEye, uSkyColor, uGroundColor; uniform sampler2DShadow uShadow;
uniform float uTexel; // radius of the blur, in shadow map units
// 1 in the sun, 0 in the shade; 16 taps on a spiral make the edge soft.
float sunlit(vec3 world, vec3 normal) {
  vec4 p = uLight * vec4(world + normal * 0.006, 1.0);
  vec3 s = p.xyz * 0.5 + 0.5;
  if (any(lessThan(s, vec3(0.0))) || any(greaterThan(s, vec3(1.0)))) return 1.0;
  float lit = 0.0;
  for (int i = 0; i < 16; i++) {
    float a = float(i) * 2.39996, r = sqrt((float(i) + 0.5) / 16.0) * uTexel;
    lit += texture(uShadow, vec3(s.xy + r * vec2(cos(a), sin(a)), s.z - 0.0006));
  }
  return lit / 16.0;
}
vec3 show(vec3 c) {
  c = c * (1.0 + c * 0.12) / (1.0 + c * 0.34); // softens what is brighter than paper
  return pow(clamp(c * 1.08, 0.0, 1.0), vec3(1.0 / 2.2));
}
`;
  return {
    depthVertex: head + placed + `
uniform mat4 uLight;
void main() { gl_Position = uLight * vec4(placed(), 1.0); }`,
    depthFragment: head + `void main() {}`,

    solidVertex: head + placed + `
uniform mat4 uViewProjection;
out vec3 vWorld, vNormal, vLocal;
void main() {
  vWorld = placed();
  vNormal = turned(normalize(aNormal / uSize));
  vLocal = aPosition.xyz;
  gl_Position = uViewProjection * vec4(vWorld, 1.0);
}`,
    solidFragment: head + light + `
uniform vec4 uColor; uniform float uFootball, uGlow;
in vec3 vWorld, vNormal, vLocal; out vec4 color;

// A football is a truncated icosahedron: a point belongs to the face whose plane it would pierce first. By symmetry
// only faces near the positive octant are compared. Result: the albedo, black pentagons with seams between panels.
vec3 football(vec3 p, vec3 white) {
  const float phi = 1.618034;
  vec3 q = abs(normalize(p));
  const float five = 1.0 / (2.32744 * 1.902113), six = 1.0 / (2.26728 * 1.7320508);
  float pent = five * max(max(q.y + phi * q.z, q.x + phi * q.y), q.z + phi * q.x);
  float best = pent, second = 0.0;
  for (int i = 0; i < 7; i++) {
    float a = i == 0 ? q.x + q.y + q.z
      : i == 1 ? q.x / phi + q.z * phi : i == 2 ? -q.x / phi + q.z * phi
      : i == 3 ? q.y * phi + q.z / phi : i == 4 ? q.y * phi - q.z / phi
      : i == 5 ? q.x * phi + q.y / phi : q.x * phi - q.y / phi;
    a *= six;
    second = max(second, min(a, best));
    best = max(best, a);
  }
  float edge = (best - second) * 3.2, soft = fwidth(edge) + 1e-4;
  float seam = 1.0 - smoothstep(0.012, 0.012 + soft * 1.5, edge);
  float black = pent >= best ? smoothstep(0.0, soft, edge + soft * 0.5) : 0.0;
  return mix(mix(white, vec3(0.012), black), vec3(0.05), seam * (1.0 - black) * 0.8);
}

void main() {
  vec3 n = normalize(vNormal), view = normalize(uEye - vWorld);
  vec3 albedo = uFootball > 0.5 ? football(vLocal, uColor.rgb) : uColor.rgb;
  float facing = dot(n, uSun), sun = max(facing, 0.0);
  if (sun > 0.0) sun *= sunlit(vWorld, n);
  // Near the ground the lower hemisphere sees less sky: a cheap contact shade.
  float near = mix(0.62, 1.0, smoothstep(0.0, 0.25, vWorld.z + max(n.z, 0.0) * 0.3));
  vec3 ambient = mix(uGroundColor, uSkyColor, n.z * 0.5 + 0.5) * near;
  float gloss = pow(max(dot(n, normalize(uSun + view)), 0.0), 48.0) * 0.22 * step(0.001, sun) * min(sun * 3.0, 1.0);
  float rim = pow(1.0 - max(dot(n, view), 0.0), 4.0) * 0.10;
  vec3 c = albedo * (ambient + uSunColor * sun) + gloss + rim * uSkyColor;
  c = mix(c, albedo, uGlow);
  color = vec4(show(c) * uColor.a, uColor.a);
}`,

    groundVertex: head + `
layout(location = 0) in vec4 aPosition;
uniform mat4 uViewProjection; uniform vec3 uCenter; uniform float uReach;
out vec3 vWorld;
void main() {
  vWorld = vec3(uCenter.xy + aPosition.xy * uReach, 0.0);
  gl_Position = uViewProjection * vec4(vWorld, 1.0);
}`,
    groundFragment: head + light + `
const int LINES = 96, RINGS = 32;
uniform vec3 uCenter; uniform float uReach;
uniform vec3 uFloor, uGrid; uniform vec4 uPitch; // middle x y, half sizes with the border; no pitch if a size is 0
uniform float uLineWidth; uniform int uLineCount, uRingCount;
uniform vec4 uLines[LINES]; // from x y, to x y, in the pitch's frame
uniform vec4 uRings[RINGS]; // middle x y, radius, half width
in vec3 vWorld; out vec4 color;

float noise(vec2 p) { return fract(sin(dot(floor(p), vec2(127.1, 311.7))) * 43758.5453); }

// How much of this pixel is white line, 0 to 1.
float marking(vec2 p, float pixel) {
  float d = 1e6;
  for (int i = 0; i < LINES; i++) {
    if (i >= uLineCount) break;
    vec2 a = uLines[i].xy, ab = uLines[i].zw - a, along = normalize(ab), q = p - a - 0.5 * ab;
    vec2 out_ = vec2(abs(dot(q, along)) - 0.5 * length(ab), abs(dot(q, vec2(-along.y, along.x)))) - 0.5 * uLineWidth;
    d = min(d, max(out_.x, out_.y));
  }
  for (int i = 0; i < RINGS; i++) {
    if (i >= uRingCount) break;
    d = min(d, abs(distance(p, uRings[i].xy) - uRings[i].z) - uRings[i].w);
  }
  return 1.0 - smoothstep(-0.7 * pixel, 0.7 * pixel, d);
}

void main() {
  vec2 xy = vWorld.xy, p = xy - uPitch.xy, pixel = fwidth(xy);
  float size = max(max(pixel.x, pixel.y), 1e-5), far = distance(xy, uCenter.xy) / uReach;

  vec2 cell = abs(fract(xy + 0.5) - 0.5) / max(pixel, vec2(1e-5));
  float grid = (1.0 - smoothstep(0.4, 1.4, min(cell.x, cell.y))) * (1.0 - smoothstep(0.1, 0.5, size));
  vec3 albedo = mix(uFloor, uGrid, grid * 0.8);

  vec2 inside = uPitch.zw - abs(p);
  if (uPitch.z > 0.0 && min(inside.x, inside.y) > -size) {
    float stripe = smoothstep(-0.02, 0.02, sin(p.x * 3.14159265)) - 0.5;
    float blades = (noise(xy * 160.0) + noise(xy * 61.0) - 1.0) * (1.0 - smoothstep(0.002, 0.012, size));
    vec3 grass = vec3(0.055, 0.205, 0.070) * (1.0 + 0.11 * stripe * (1.0 - smoothstep(0.2, 1.0, size)) + 0.10 * blades);
    grass = mix(grass, vec3(0.80), marking(p, size) * 0.94);
    albedo = mix(albedo, grass, smoothstep(-size, size, min(inside.x, inside.y)));
  }
  float sun = uSun.z * sunlit(vWorld, vec3(0.0, 0.0, 1.0));
  vec3 c = albedo * (uSkyColor * 0.85 + uSunColor * sun);
  float alpha = 1.0 - smoothstep(0.35, 1.0, far);
  color = vec4(show(c) * alpha, alpha);
}`,
  };
})();
