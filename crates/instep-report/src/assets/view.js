// The 3-D view: draws the replay at a time, with an orbiting camera. `createView` throws if WebGL 2 is missing.
function createView(canvas, replay, onUsed) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: true });
  if (!gl) throw new Error("WebGL 2 is not available");
  const SUN = math.unit([0.5, -0.75, 1.15]), SHADOW_SIZE = 2048, FIELD_OF_VIEW = 0.6;
  const linear = c => Math.pow(c / 255, 2.2);

  // ---- Programs and meshes -------------------------------------------------------------------------------------
  function program(vertex, fragment) {
    const p = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) || "shader");
      gl.attachShader(p, shader);
    }
    gl.linkProgram(p);
    if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p) || "program");
    const at = {};
    for (let i = 0; i < gl.getProgramParameter(p, gl.ACTIVE_UNIFORMS); i++) {
      const name = gl.getActiveUniform(p, i).name.replace("[0]", "");
      at[name] = gl.getUniformLocation(p, name);
    }
    return { p, at };
  }
  function upload({ vertices, indices }) {
    const vao = gl.createVertexArray();
    gl.bindVertexArray(vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(indices), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 28, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 28, 16);
    return { vao, count: indices.length };
  }
  const depth = program(shaders.depthVertex, shaders.depthFragment);
  const solid = program(shaders.solidVertex, shaders.solidFragment);
  const ground = program(shaders.groundVertex, shaders.groundFragment);
  const mesh = {
    capsule: upload(meshes.capsule()), cylinder: upload(meshes.cylinder()), cone: upload(meshes.cylinder(0)),
    box: upload(meshes.box()), quad: upload(meshes.quad()),
  };

  // ---- Shadow map ----------------------------------------------------------------------------------------------
  const shadowMap = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, shadowMap);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  const shadowFrame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, shadowFrame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, shadowMap, 0);
  gl.drawBuffers([gl.NONE]);

  // ---- What to draw at a time ----------------------------------------------------------------------------------
  // Item: { mesh, position, rotation [w x y z], size [3], half, color [r g b a linear], football, glow }.
  function readPose(part, offset, t) {
    const data = part.poses, frames = data.length / 7;
    if (!frames) return null;
    const [i, s] = frames === 1 ? [0, 0] : math.frameAt(replay.times, t);
    const a = Math.min(i, frames - 1) * 7, b = Math.min(i + 1, frames - 1) * 7;
    const position = [0, 1, 2].map(k => data[a + k] * (1 - s) + data[b + k] * s + offset[k]);
    const rotation = math.mixQuaternions([...data.subarray(a + 3, a + 7)], [...data.subarray(b + 3, b + 7)], s);
    return { position, rotation };
  }
  const color = c => [linear(c[0]), linear(c[1]), linear(c[2]), c[3] / 255];
  const shapes = { // size and half length for the shader, from the shape's own numbers
    sphere: ([r]) => ({ mesh: mesh.capsule, size: [r, r, r], half: 0 }),
    ellipsoid: r => ({ mesh: mesh.capsule, size: r, half: 0 }),
    capsule: ([r, h]) => ({ mesh: mesh.capsule, size: [r, r, r], half: h }),
    cylinder: ([r, h]) => ({ mesh: mesh.cylinder, size: [r, r, h], half: 0 }),
    box: h => ({ mesh: mesh.box, size: h, half: 0 }),
  };
  for (const actor of replay.actors)
    for (const part of actor.parts)
      part.fixed = { ...shapes[part.shape](part.size), color: color(part.color), football: part.football ? 1 : 0, glow: 0 };

  function arrowItems(arrow, offset, t) {
    const data = arrow.frames, frames = data.length / 6;
    if (!frames) return [];
    const [i, s] = frames === 1 ? [0, 0] : math.frameAt(replay.times, t);
    const a = Math.min(i, frames - 1) * 6, b = Math.min(i + 1, frames - 1) * 6;
    const v = [0, 1, 2, 3, 4, 5].map(k => data[a + k] * (1 - s) + data[b + k] * s);
    const origin = math.add(v.slice(0, 3), offset), vector = math.scale(v.slice(3), arrow.scale);
    const length = math.length(vector);
    if (!(length > 0.01)) return [];
    const direction = math.unit(vector), rotation = math.quaternionFromZ(direction);
    const r = 0.011, head = Math.min(0.075, length * 0.45), shaft = length - head;
    const common = { rotation, half: 0, color: color(arrow.color), football: 0, glow: 0.55 };
    return [
      { ...common, mesh: mesh.cylinder, size: [r, r, shaft / 2], position: math.add(origin, math.scale(direction, shaft / 2)) },
      { ...common, mesh: mesh.cone, size: [2.6 * r, 2.6 * r, head / 2], position: math.add(origin, math.scale(direction, shaft + head / 2)) },
    ];
  }
  function sceneAt(t) {
    const scene = { solid: [], ghost: [], arrows: [] };
    for (const actor of replay.actors) {
      for (const part of actor.parts) {
        const pose = readPose(part, actor.offset, t);
        if (pose) (part.color[3] < 255 ? scene.ghost : scene.solid).push({ ...part.fixed, ...pose });
      }
      for (const arrow of actor.arrows) scene.arrows.push(...arrowItems(arrow, actor.offset, t));
    }
    return scene;
  }

  // ---- Camera --------------------------------------------------------------------------------------------------
  // The ground point under the first actor, evened out over 0.4 s so that the camera does not sway with each step.
  const lead = replay.actors[0];
  const path = replay.times.map(t => {
    const poses = lead ? lead.parts.map(part => readPose(part, lead.offset, t)).filter(Boolean) : [];
    const sum = poses.reduce((s, pose) => math.add(s, pose.position), [0, 0, 0]);
    return poses.length ? [sum[0] / poses.length, sum[1] / poses.length, 0] : [0, 0, 0];
  });
  function followed(t) {
    const n = 8, last = path.length - 1;
    let sum = [0, 0, 0];
    for (let k = 0; k <= n; k++) {
      const [i, s] = math.frameAt(replay.times, t + (k / n - 0.5) * 0.4), a = path[i] || [0, 0, 0], b = path[Math.min(i + 1, last)] || a;
      sum = math.add(sum, math.add(math.scale(a, 1 - s), math.scale(b, s)));
    }
    return math.scale(sum, 1 / (n + 1));
  }
  // A first view that shows the first actor whole, and what stands close to it.
  function firstView() {
    const start = replay.times[0] || 0, base = followed(start);
    if (replay.camera) {
      const c = replay.camera;
      return { target: math.sub(c.target, base), distance: c.distance, azimuth: c.azimuth, elevation: c.elevation };
    }
    let low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
    const grow = (actor, reach) => {
      for (const part of actor.parts) {
        const pose = readPose(part, actor.offset, start);
        if (!pose || math.length(math.sub([pose.position[0], pose.position[1], 0], base)) > reach) continue;
        const r = Math.max(...part.fixed.size) + part.fixed.half;
        low = low.map((v, k) => Math.min(v, pose.position[k] - r));
        high = high.map((v, k) => Math.max(v, pose.position[k] + r));
      }
    };
    if (lead) grow(lead, Infinity);
    const height = Math.max(high[2], 0.2);
    for (const actor of replay.actors) grow(actor, 1.6 * height);
    if (low[0] > high[0]) return { target: [0, 0, 0.4], distance: 4, azimuth: -1.05, elevation: 0.25 };
    const middle = math.scale(math.add(low, high), 0.5), size = math.length(math.sub(high, low));
    return { target: math.sub([middle[0], middle[1], height * 0.46], base), distance: Math.max(0.6, size * 1.62), azimuth: -1.0, elevation: 0.24 };
  }
  const home = firstView();
  let camera = { ...home }, follow = true, frozen = followed(replay.times[0] || 0), now = replay.times[0] || 0, pending = false;

  // ---- Drawing -------------------------------------------------------------------------------------------------
  function place(at, item) {
    gl.uniform3fv(at.uPosition, item.position);
    gl.uniform4f(at.uRotation, item.rotation[1], item.rotation[2], item.rotation[3], item.rotation[0]);
    gl.uniform3fv(at.uSize, item.size);
    gl.uniform1f(at.uHalf, item.half);
    gl.bindVertexArray(item.mesh.vao);
  }
  const drawMesh = m => gl.drawElements(gl.TRIANGLES, m.count, gl.UNSIGNED_SHORT, 0);
  function drawItems(items) {
    for (const item of items) {
      place(solid.at, item);
      gl.uniform4fv(solid.at.uColor, item.color);
      gl.uniform1f(solid.at.uFootball, item.football);
      gl.uniform1f(solid.at.uGlow, item.glow);
      drawMesh(item.mesh);
    }
  }
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const pitch = replay.pitch;

  function draw() {
    pending = false;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }

    const scene = sceneAt(now), base = follow ? followed(now) : frozen;
    const target = math.add(base, camera.target), ce = Math.cos(camera.elevation);
    const out = [ce * Math.cos(camera.azimuth), ce * Math.sin(camera.azimuth), Math.sin(camera.elevation)];
    const eye = math.add(target, math.scale(out, camera.distance));
    eye[2] = Math.max(eye[2], 0.02);
    const view = math.lookAt(eye, target, [0, 0, 1]);
    // A narrow view is framed by its width.
    const fov = 2 * Math.atan(Math.tan(FIELD_OF_VIEW / 2) * Math.max(1, 1.1 * height / width));
    const viewProjection = math.multiply(math.perspective(fov, width / height, camera.distance * 0.02, camera.distance * 12 + 60), view);

    // The shadow map covers the followed actor and what is near the middle of the view.
    const reach = math.clamp(camera.distance * 0.75, 1.2, 9);
    const light = math.multiply(math.orthographic(reach, 3 * reach + 4), math.lookAt(math.add(target, SUN), target, [0, 1, 0]));
    gl.bindFramebuffer(gl.FRAMEBUFFER, shadowFrame);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.disable(gl.BLEND);
    gl.depthMask(true);
    gl.colorMask(true, true, true, true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 3);
    gl.useProgram(depth.p);
    gl.uniformMatrix4fv(depth.at.uLight, false, light);
    for (const item of scene.solid) { place(depth.at, item); drawMesh(item.mesh); }
    gl.disable(gl.POLYGON_OFFSET_FILL);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, shadowMap);
    const night = dark.matches;
    for (const { p, at } of [ground, solid]) {
      gl.useProgram(p);
      gl.uniformMatrix4fv(at.uViewProjection, false, viewProjection);
      gl.uniformMatrix4fv(at.uLight, false, light);
      gl.uniform1i(at.uShadow, 0);
      gl.uniform1f(at.uTexel, 0.014 / reach);
      gl.uniform3fv(at.uSun, SUN);
      gl.uniform3fv(at.uSunColor, night ? [0.84, 0.83, 0.81] : [1.05, 1.02, 0.97]);
      gl.uniform3fv(at.uEye, eye);
      gl.uniform3fv(at.uSkyColor, night ? [0.30, 0.35, 0.44] : [0.56, 0.62, 0.70]);
      gl.uniform3fv(at.uGroundColor, pitch ? [0.10, 0.16, 0.10] : [0.20, 0.20, 0.21]);
    }
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    drawGround(target, night);
    gl.useProgram(solid.p);
    drawItems(scene.solid);
    drawItems(scene.arrows);
    // The part of an arrow that is inside or behind something shows through faintly.
    gl.depthFunc(gl.GREATER);
    gl.depthMask(false);
    drawItems(scene.arrows.map(item => ({ ...item, color: [...item.color.slice(0, 3), 0.45 * item.color[3]] })));
    gl.depthMask(true);
    gl.depthFunc(gl.LESS);
    // Ghosts: depth first, then colour, so that only their nearest surface shows.
    gl.colorMask(false, false, false, false);
    drawItems(scene.ghost);
    gl.colorMask(true, true, true, true);
    gl.depthFunc(gl.LEQUAL);
    drawItems(scene.ghost);
    gl.depthFunc(gl.LESS);
  }
  function drawGround(target, night) {
    const at = ground.at;
    gl.useProgram(ground.p);
    gl.uniform3f(at.uCenter, target[0], target[1], 0);
    gl.uniform1f(at.uReach, Math.max(9, camera.distance * 5));
    gl.uniform3fv(at.uFloor, night ? [0.035, 0.043, 0.055] : [0.52, 0.55, 0.58]);
    gl.uniform3fv(at.uGrid, night ? [0.10, 0.12, 0.14] : [0.34, 0.37, 0.41]);
    gl.uniform4f(at.uPitch, ...(pitch ? [...pitch.center, ...pitch.halfSize] : [0, 0, 0, 0]));
    const lines = pitch ? pitch.lines.slice(0, 96) : [], rings = pitch ? pitch.rings.slice(0, 32) : [];
    gl.uniform1i(at.uLineCount, lines.length);
    gl.uniform1i(at.uRingCount, rings.length);
    gl.uniform1f(at.uLineWidth, pitch ? pitch.lineWidth : 0);
    if (lines.length) gl.uniform4fv(at.uLines, lines.flat());
    if (rings.length) gl.uniform4fv(at.uRings, rings.flat());
    gl.bindVertexArray(mesh.quad.vao);
    gl.disable(gl.CULL_FACE);
    drawMesh(mesh.quad);
    gl.enable(gl.CULL_FACE);
  }
  const redraw = () => { if (!pending) { pending = true; requestAnimationFrame(draw); } };

  // ---- Mouse and touch -----------------------------------------------------------------------------------------
  const pointers = new Map();
  const orbit = (dx, dy) => {
    camera.azimuth -= dx * 0.007;
    camera.elevation = math.clamp(camera.elevation + dy * 0.006, -0.05, 1.569);
  };
  const pan = (dx, dy) => {
    const s = (2 * camera.distance * Math.tan(FIELD_OF_VIEW / 2)) / Math.max(1, canvas.clientHeight);
    const right = [-Math.sin(camera.azimuth), Math.cos(camera.azimuth), 0], e = Math.sin(camera.elevation);
    const up = [-Math.cos(camera.azimuth) * e, -Math.sin(camera.azimuth) * e, Math.cos(camera.elevation)];
    camera.target = math.add(camera.target, math.add(math.scale(right, -dx * s), math.scale(up, dy * s)));
  };
  const zoom = factor => { camera.distance = math.clamp(camera.distance * factor, 0.3, 60); };
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pan: event.button !== 0 || event.shiftKey });
    onUsed();
  });
  canvas.addEventListener("pointermove", event => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(pointer.x - other.x, pointer.y - other.y), after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 0 && after > 0) zoom(before / after);
      pan(dx / 2, dy / 2);
    } else if (pointer.pan) pan(dx, dy);
    else orbit(dx, dy);
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    redraw();
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, event => pointers.delete(event.pointerId));
  canvas.addEventListener("wheel", event => {
    // Until it is clicked the view lets the page scroll.
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(math.clamp(event.deltaY, -120, 120) * 0.0016));
    redraw();
  }, { passive: false });
  new ResizeObserver(redraw).observe(canvas);
  dark.addEventListener("change", redraw);

  const presets = { side: [-Math.PI / 2, 0.12], front: [0, 0.12], top: [-Math.PI / 2, 1.569] };
  return {
    setTime(t) { now = t; redraw(); },
    look(name) {
      if (name === "reset") camera = { ...home };
      else if (presets[name]) [camera.azimuth, camera.elevation] = presets[name];
      redraw();
    },
    setFollow(on) {
      if (!on) frozen = followed(now);
      follow = on;
      redraw();
    },
  };
}
