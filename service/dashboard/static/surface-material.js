// How surfaces are lit: flat, from the camera, by a shader that costs a third of three.js' own.

// Facets, not an impression of smoothness, are what is judged here: the normal is that of the
// triangle, from how the place changes from pixel to pixel. What is looked at is never in the dark.
const VERTEX = `
  varying vec3 seen;
  varying vec2 place;
  void main() {
    vec4 at = modelViewMatrix * vec4(position, 1.0);
    seen = at.xyz;
    place = uv;
    gl_Position = projectionMatrix * at;
  }`;
const FRAGMENT = `
  uniform sampler2D map;
  uniform bool mapped;
  uniform vec3 color;
  uniform float opacity;
  varying vec3 seen;
  varying vec2 place;
  void main() {
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    float light = 0.48 + 0.56 * abs(dot(normal, normalize(seen)));
    vec3 own = mapped ? texture2D(map, place).rgb : color;
    gl_FragColor = vec4(own * light, opacity);
  }`;

/** A material in one colour, which may be translucent, or with a map. */
export function surfaceMaterial(THREE, colour, opacity = 1) {
  return new THREE.ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { map: { value: null }, mapped: { value: false }, color: { value: new THREE.Color(colour) }, opacity: { value: opacity } },
    extensions: { derivatives: true },
    side: THREE.DoubleSide,
    transparent: opacity < 1,
    depthWrite: opacity === 1,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
}
