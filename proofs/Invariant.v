(** An inductive invariant implies the formula: the checker and its soundness.

    A flight's time is cut into spans.  A system has states; in each span it makes
    some of the moves, with or without a letter, and hands its state to the next
    span.  An invariant is, for each span, a list of states with what they owe. *)

Require Import List Bool Arith Lia.
From LtlPlan Require Import Progression.
Import ListNotations.

Section System.
  Variables (S Span : Type) (equal : S -> S -> bool).
  Variable moves : Span -> S -> list (option letter * S).
  Variable enters : Span -> S -> bool.
  Variable final : S -> bool.
  Hypothesis equal_eq : forall s t, equal s t = true -> s = t.

  Definition read (o : option letter) (w : word) : word :=
    match o with Some a => a :: w | None => w end.

  (** The words of the system from a state in the first of the spans. *)
  Inductive run : list Span -> S -> word -> Prop :=
    | run_end : forall p s, final s = true -> run [p] s []
    | run_move : forall p ps s o t w,
        In (o, t) (moves p s) -> run (p :: ps) t w -> run (p :: ps) s (read o w)
    | run_span : forall p q ps s w,
        enters q s = true -> run (q :: ps) s w -> run (p :: q :: ps) s w.

  (** *** The algorithm *)

  Definition invariant : Type := list (S * state).

  Definition covered (i : invariant) (s : S) (d : state) : bool :=
    existsb (fun e => equal s (fst e) && implies (snd e) d) i.

  Definition after (o : option letter) (d : state) : state :=
    match o with Some a => progress_state a d | None => d end.

  Definition closed (p : Span) (i : invariant) : bool :=
    forallb (fun e =>
      forallb (fun m => covered i (snd m) (after (fst m) (snd e))) (moves p (fst e))) i.

  Definition handed (q : Span) (i j : invariant) : bool :=
    forallb (fun e => negb (enters q (fst e)) || covered j (fst e) (snd e)) i.

  Definition accepted (i : invariant) : bool :=
    forallb (fun e => negb (final (fst e)) || accepts (snd e)) i.

  Fixpoint chain (ps : list Span) (is : list invariant) : bool :=
    match ps, is with
    | [p], [i] => closed p i && accepted i
    | p :: (q :: _) as qs, i :: (j :: _) as js => closed p i && handed q i j && chain qs js
    | _, _ => false
    end.

  Definition check_invariant (f : formula) (starts : list (option letter * S))
      (ps : list Span) (is : list invariant) : bool :=
    match is with
    | i :: _ => forallb (fun m => covered i (snd m) (after (fst m) [[f]])) starts && chain ps is
    | [] => false
    end.

  (** *** Its soundness *)

  Lemma after_read : forall o d w, owes (after o d) w -> owes d (read o w).
  Proof. intros [a|] d w H; [apply progress_state_sat; auto | auto]. Qed.

  Lemma covered_entry : forall i s d w, covered i s d = true ->
    (forall e, In (s, e) i -> owes e w) -> owes d w.
  Proof.
    intros i s d w C H; apply existsb_exists in C as ([t e] & I & C).
    apply andb_prop in C as [E M]; apply equal_eq in E; cbn in E, M; subst t.
    apply (implies_sound e d w M), H, I.
  Qed.

  Lemma chain_head : forall p ps i is, chain (p :: ps) (i :: is) = true -> closed p i = true.
  Proof.
    intros p ps i is H; destruct ps as [|q ps], is as [|j is]; try discriminate; cbn in H.
    - apply andb_prop in H; tauto.
    - repeat (apply andb_prop in H as [H ?]); auto.
  Qed.

  Lemma chain_sound : forall ps s w, run ps s w -> forall i is e,
    chain ps (i :: is) = true -> In (s, e) i -> owes e w.
  Proof.
    induction 1 as [p s F | p ps s o t w M R IH | p q ps s w E R IH]; intros i is e C I.
    - destruct is; [|discriminate]; cbn in C; apply andb_prop in C as [_ A].
      unfold accepted in A; rewrite forallb_forall in A; specialize (A _ I); cbn in A.
      rewrite F in A; apply accepts_sound; auto.
    - pose proof (chain_head _ _ _ _ C) as K; unfold closed in K.
      rewrite forallb_forall in K; specialize (K _ I); cbn in K.
      rewrite forallb_forall in K; specialize (K _ M); cbn in K.
      apply after_read, (covered_entry i t _ _ K); intros e' I'; apply (IH i is); auto.
    - destruct is as [|j is]; [discriminate|].
      change (closed p i && handed q i j && chain (q :: ps) (j :: is) = true) in C.
      apply andb_prop in C as [K C]; apply andb_prop in K as [_ K].
      unfold handed in K; rewrite forallb_forall in K; specialize (K _ I); cbn in K.
      rewrite E in K; cbn in K.
      apply (covered_entry j s _ _ K); intros e' I'; apply (IH j is); auto.
  Qed.

  Theorem check_invariant_sound : forall f starts ps is o s w,
    check_invariant f starts ps is = true -> In (o, s) starts -> run ps s w ->
    sat f (read o w).
  Proof.
    intros f starts ps [|i is] o s w H I R; [discriminate|]; cbn in H.
    apply andb_prop in H as [A C]; rewrite forallb_forall in A; specialize (A _ I); cbn in A.
    apply owes_one, after_read, (covered_entry i s _ _ A); intros e Ie.
    apply (chain_sound ps s w R i is e C Ie).
  Qed.
End System.

(** ** Teams

    Each robot has places in an order of its own: what it shows, and from which to
    which it may change.  A span says where each robot may be in it.  Any subset of
    the robots may change at one instant. *)

Record robot := Robot { shown : list letter; changes : list (nat * nat) }.
Definition span : Type := list (list nat).
Definition places : Type := list nat.

Definition letter_at (r : robot) (q : nat) : letter := nth q (shown r) [].
Definition member (q : nat) (l : list nat) : bool := existsb (Nat.eqb q) l.

Fixpoint permitted (p : span) (c : places) : bool :=
  match p, c with
  | [], [] => true
  | l :: p', q :: c' => member q l && permitted p' c'
  | _, _ => false
  end.

Inductive changed : list robot -> places -> places -> Prop :=
  | changed_none : changed [] [] []
  | changed_robot : forall r rs q q' c c',
      q' = q \/ In (q, q') (changes r) -> changed rs c c' ->
      changed (r :: rs) (q :: c) (q' :: c').

Definition targets (r : robot) (q : nat) : list nat :=
  map snd (filter (fun e => fst e =? q) (changes r)).

Fixpoint product {A} (ls : list (list A)) : list (list A) :=
  match ls with
  | [] => [[]]
  | l :: r => flat_map (fun x => map (cons x) (product r)) l
  end.

Lemma targets_in : forall r q q', In (q, q') (changes r) -> In q' (targets r q).
Proof.
  intros r q q' H; unfold targets; apply in_map_iff; exists (q, q'); split; auto.
  apply filter_In; split; auto; apply Nat.eqb_refl.
Qed.

Lemma product_in : forall A (x : A) l xs ls,
  In x l -> In xs (product ls) -> In (x :: xs) (product (l :: ls)).
Proof. intros; simpl; apply in_flat_map; exists x; split; auto; apply in_map; auto. Qed.

Fixpoint equal_places (c d : places) : bool :=
  match c, d with
  | [], [] => true
  | q :: c', r :: d' => (q =? r) && equal_places c' d'
  | _, _ => false
  end.

Lemma equal_places_eq : forall c d, equal_places c d = true -> c = d.
Proof.
  induction c as [|q c IH]; intros [|r d] H; try discriminate; auto; cbn in H.
  apply andb_prop in H as [E H]; f_equal; auto; apply Nat.eqb_eq; auto.
Qed.

Section Joint.
  (** The team's letter: of what all robots show at one time. *)
  Variable team_letter : list letter -> letter.
  Variable robots : list robot.

  Fixpoint shows_all (rs : list robot) (c : places) : list letter :=
    match rs, c with
    | r :: rs', q :: c' => letter_at r q :: shows_all rs' c'
    | _, _ => []
    end.
  Definition joint_letter (c : places) : letter := team_letter (shows_all robots c).

  (** A flight: where the robots are, one instant after another. *)
  Inductive joint_course : list span -> places -> list places -> Prop :=
    | joint_end : forall p c, joint_course [p] c []
    | joint_change : forall p ps c c' cs, changed robots c c' -> permitted p c' = true ->
        joint_course (p :: ps) c' cs -> joint_course (p :: ps) c (c' :: cs)
    | joint_span : forall p q ps c cs, permitted q c = true ->
        joint_course (q :: ps) c cs -> joint_course (p :: q :: ps) c cs.

  Fixpoint joint_choices (rs : list robot) (c : places) : list (list nat) :=
    match rs, c with
    | r :: rs', q :: c' => (q :: targets r q) :: joint_choices rs' c'
    | _, _ => []
    end.

  Definition joint_moves (p : span) (c : places) : list (option letter * places) :=
    map (fun d => (Some (joint_letter d), d))
      (filter (permitted p) (product (joint_choices robots c))).

  Definition joint_starts (cs : list places) : list (option letter * places) :=
    map (fun c => (Some (joint_letter c), c)) cs.

  Definition check_joint (f : spec) (starts : list places) (ps : list span)
      (is : list (invariant places)) : bool :=
    check_invariant _ _ equal_places joint_moves permitted (fun _ => true)
      (normal true f) (joint_starts starts) ps is.

  Lemma changed_choices : forall rs c c', changed rs c c' ->
    In c' (product (joint_choices rs c)).
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; [left; auto|].
    cbn [joint_choices]; apply product_in; auto.
    destruct H as [->|H]; [left | right; apply targets_in]; auto.
  Qed.

  Lemma joint_run : forall ps c cs, joint_course ps c cs ->
    run _ _ joint_moves permitted (fun _ => true) ps c (map joint_letter cs).
  Proof.
    induction 1 as [p c | p ps c c' cs H P K IH | p q ps c cs P K IH].
    - apply run_end; auto.
    - apply (run_move _ _ joint_moves permitted (fun _ => true) p ps c (Some (joint_letter c')) c');
        auto.
      unfold joint_moves; apply in_map_iff; exists c'; split; auto.
      apply filter_In; split; auto; apply changed_choices; auto.
    - apply run_span; auto.
  Qed.

  Theorem check_joint_sound : forall f starts ps is c cs,
    check_joint f starts ps is = true -> In c starts -> joint_course ps c cs ->
    ssat f (map joint_letter (c :: cs)).
  Proof.
    intros f starts ps is c cs H I K; apply normal_sat; [discriminate|].
    apply (check_invariant_sound _ _ _ _ _ _ equal_places_eq _ _ _ _
      (Some (joint_letter c)) c (map joint_letter cs) H); [|apply joint_run; auto].
    unfold joint_starts; apply in_map_iff; exists c; auto.
  Qed.
End Joint.

Section Own.
  (** A position of the word is one robot's letter; each robot is read at least once
      in each of its letters, and a letter that is held may be read again. *)
  Variable robots : list robot.

  Inductive event := Read (i : nat) | Change (c : places).

  (** A flight with its readings. *)
  Inductive own_course : list span -> places -> list event -> Prop :=
    | own_end : forall p c, own_course [p] c []
    | own_read : forall p ps c i es, i < length robots ->
        own_course (p :: ps) c es -> own_course (p :: ps) c (Read i :: es)
    | own_change : forall p ps c c' es, changed robots c c' -> permitted p c' = true ->
        own_course (p :: ps) c' es -> own_course (p :: ps) c (Change c' :: es)
    | own_span : forall p q ps c es, permitted q c = true ->
        own_course (q :: ps) c es -> own_course (p :: q :: ps) c es.

  Definition own_letter (i : nat) (c : places) : letter :=
    letter_at (nth i robots (Robot [] [])) (nth i c 0).

  Fixpoint own_word (c : places) (es : list event) : word :=
    match es with
    | [] => []
    | Read i :: r => own_letter i c :: own_word c r
    | Change c' :: r => own_word c' r
    end.

  (** Letters are the same where they hold the same propositions. *)
  Definition same_letter (a b : letter) : bool :=
    forallb (fun p => member p b) a && forallb (fun p => member p a) b.

  (** Robot [i] is read in each of its letters; [b]: it was read in the present one. *)
  Fixpoint read_in_each (i : nat) (b : bool) (c : places) (es : list event) : Prop :=
    match es with
    | [] => b = true
    | Read j :: r => read_in_each i (b || (i =? j)) c r
    | Change c' :: r =>
        if same_letter (own_letter i c) (own_letter i c') then read_in_each i b c' r
        else b = true /\ read_in_each i false c' r
    end.

  (** *** The system: places, and who was read since its letter changed *)

  Definition marked : Type := list (nat * bool).

  Fixpoint equal_marked (c d : marked) : bool :=
    match c, d with
    | [], [] => true
    | (q, b) :: c', (r, e) :: d' => (q =? r) && Bool.eqb b e && equal_marked c' d'
    | _, _ => false
    end.

  Lemma equal_marked_eq : forall c d, equal_marked c d = true -> c = d.
  Proof.
    induction c as [|[q b] c IH]; intros [|[r e] d] H; try discriminate; auto; cbn in H.
    apply andb_prop in H as [H K]; apply andb_prop in H as [E B].
    apply Nat.eqb_eq in E; apply eqb_prop in B; subst; f_equal; auto.
  Qed.

  Definition moved (r : robot) (q : nat) (b : bool) (q' : nat) : list (nat * bool) :=
    if same_letter (letter_at r q) (letter_at r q') then [(q', b)]
    else if b then [(q', false)] else [].

  Fixpoint own_choices (rs : list robot) (s : marked) : list (list (nat * bool)) :=
    match rs, s with
    | r :: rs', (q, b) :: s' =>
        ((q, b) :: flat_map (moved r q b) (targets r q)) :: own_choices rs' s'
    | _, _ => []
    end.

  Fixpoint mark (i : nat) (s : marked) : marked :=
    match s, i with
    | [], _ => []
    | (q, _) :: r, O => (q, true) :: r
    | x :: r, S j => x :: mark j r
    end.

  Definition own_moves (p : span) (s : marked) : list (option letter * marked) :=
    map (fun i => (Some (own_letter i (map fst s)), mark i s)) (seq 0 (length robots)) ++
    map (fun t => (None, t))
      (filter (fun t => permitted p (map fst t)) (product (own_choices robots s))).

  Definition own_enters (p : span) (s : marked) : bool := permitted p (map fst s).
  Definition own_final (s : marked) : bool := forallb snd s.
  Definition unread (c : places) : marked := map (fun q => (q, false)) c.

  Definition check_own (f : spec) (starts : list places) (ps : list span)
      (is : list (invariant marked)) : bool :=
    check_invariant _ _ equal_marked own_moves own_enters own_final
      (normal true f) (map (fun c => (None, unread c)) starts) ps is.

  (** *** Its soundness *)

  Fixpoint read_after (rs : list robot) (s : marked) (c' : places) : marked :=
    match rs, s, c' with
    | r :: rs', (q, b) :: s', q' :: c'' =>
        (q', if same_letter (letter_at r q) (letter_at r q') then b else false)
          :: read_after rs' s' c''
    | _, _, _ => []
    end.

  (** May all robots go on?  Robot by robot, as [read_in_each] asks. *)
  Fixpoint may_change (rs : list robot) (s : marked) (c' : places) : Prop :=
    match rs, s, c' with
    | r :: rs', (q, b) :: s', q' :: c'' =>
        (same_letter (letter_at r q) (letter_at r q') = true \/ b = true)
          /\ may_change rs' s' c''
    | _, _, _ => True
    end.

  Lemma same_letter_refl : forall a, same_letter a a = true.
  Proof.
    intros a; unfold same_letter; apply andb_true_iff; split; apply forallb_forall; intros p H;
      unfold member; apply existsb_exists; exists p; split; auto using Nat.eqb_refl.
  Qed.

  Lemma own_choices_in : forall rs s c', changed rs (map fst s) c' -> may_change rs s c' ->
    In (read_after rs s c') (product (own_choices rs s)).
  Proof.
    intros rs s c' H; remember (map fst s) as c eqn:E; revert s E.
    induction H as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] E M; try discriminate.
    - left; auto.
    - injection E as <- ->; destruct M as [M1 M2]; cbn [own_choices read_after].
      apply product_in; [|apply IH; auto].
      destruct H as [->|H].
      + left; now rewrite same_letter_refl.
      + right; apply in_flat_map; exists q'; split; [apply targets_in; auto|].
        unfold moved; destruct (same_letter _ _); [left; auto|].
        destruct M1 as [M1 | ->]; [discriminate | left; auto].
  Qed.

  Lemma read_after_places : forall rs c c', changed rs c c' ->
    forall s, map fst s = c -> map fst (read_after rs s c') = c'.
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] E; try discriminate; auto.
    injection E as <- E; cbn; f_equal; auto.
  Qed.

  Lemma read_after_nth : forall rs c c', changed rs c c' ->
    forall s i, map fst s = c -> i < length rs ->
    let a := letter_at (nth i rs (Robot [] [])) in
    snd (nth i (read_after rs s c') (0, false)) =
    (if same_letter (a (nth i c 0)) (a (nth i c' 0)) then snd (nth i s (0, false)) else false).
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] i E L; cbn in L; try lia;
      try discriminate.
    injection E as <- E; destruct i as [|i]; cbn; [destruct (same_letter _ _); auto|].
    apply IH; auto; lia.
  Qed.

  Lemma may_change_all : forall rs c c', changed rs c c' -> forall s, map fst s = c ->
    (forall i, i < length rs ->
      let a := letter_at (nth i rs (Robot [] [])) in
      same_letter (a (nth i c 0)) (a (nth i c' 0)) = true \/ snd (nth i s (0, false)) = true) ->
    may_change rs s c'.
  Proof.
    induction 1 as [|r rs q q' c c' H K IH]; intros [|[q0 b] s] E A; try discriminate; cbn; auto.
    injection E as <- E; split; [apply (A 0); cbn; lia|].
    apply IH; auto; intros i L; apply (A (S i)); cbn; lia.
  Qed.

  Lemma mark_places : forall s i, map fst (mark i s) = map fst s.
  Proof. induction s as [|[q b] s IH]; intros [|i]; cbn; auto; f_equal; auto. Qed.

  Lemma mark_nth : forall s i j, j < length s ->
    snd (nth j (mark i s) (0, false)) = snd (nth j s (0, false)) || (j =? i).
  Proof.
    induction s as [|[q b] s IH]; intros i j L; cbn in L; [lia|].
    destruct i as [|i], j as [|j]; cbn; rewrite ?orb_true_r, ?orb_false_r; auto.
    apply IH; lia.
  Qed.

  Lemma changed_length : forall rs c c', changed rs c c' ->
    length c = length rs /\ length c' = length rs.
  Proof. induction 1; cbn; lia. Qed.

  Lemma own_run : forall ps c es, own_course ps c es ->
    forall s, map fst s = c -> length s = length robots ->
    (forall i, i < length robots -> read_in_each i (snd (nth i s (0, false))) c es) ->
    run _ _ own_moves own_enters own_final ps s (own_word c es).
  Proof.
    induction 1 as [p c | p ps c i es L K IH | p ps c c' es H P K IH | p q ps c es P K IH];
      intros s E N A.
    - apply run_end; apply forallb_forall; intros x I.
      apply (In_nth _ _ (0, false)) in I as (i & L & <-); apply A; lia.
    - apply (run_move _ _ own_moves own_enters own_final p ps s (Some (own_letter i c)) (mark i s)).
      + unfold own_moves; apply in_or_app; left; apply in_map_iff; exists i.
        rewrite E; split; auto; apply in_seq; lia.
      + apply IH; [rewrite mark_places; auto | |].
        * rewrite <- (map_length fst), mark_places, map_length; auto.
        * intros j Lj; rewrite mark_nth by lia; apply (A j Lj).
    - pose proof (changed_length _ _ _ H) as [Lc Lc'].
      apply (run_move _ _ own_moves own_enters own_final p ps s None (read_after robots s c')).
      + unfold own_moves; apply in_or_app; right; apply in_map_iff.
        exists (read_after robots s c'); split; auto; apply filter_In; split.
        * apply own_choices_in; [rewrite E; auto|].
          apply (may_change_all _ _ _ H); auto; intros i L a; specialize (A i L); cbn in A.
          unfold own_letter in A; fold a in A.
          destruct (same_letter _ _); [auto | right; tauto].
        * rewrite (read_after_places _ _ _ H); auto.
      + apply IH.
        * apply (read_after_places _ _ _ H); auto.
        * rewrite <- (map_length fst), (read_after_places _ _ _ H); auto.
        * intros i L; rewrite (read_after_nth _ _ _ H) by auto; specialize (A i L); cbn in A.
          unfold own_letter in A; destruct (same_letter _ _); [auto | tauto].
    - apply run_span; [unfold own_enters; rewrite E; auto | apply IH; auto].
  Qed.

  Lemma own_word_nonempty : forall es c i, read_in_each i false c es -> own_word c es <> [].
  Proof.
    induction es as [|[j|c'] es IH]; intros c i H; cbn in *; try discriminate.
    destruct (same_letter _ _); [eauto | destruct H; discriminate].
  Qed.

  Theorem check_own_sound : forall f starts ps is c es,
    check_own f starts ps is = true -> In c starts -> own_course ps c es ->
    robots <> [] -> length c = length robots ->
    (forall i, i < length robots -> read_in_each i false c es) ->
    ssat f (own_word c es).
  Proof.
    intros f starts ps is c es H I K R L A; apply normal_sat.
    { apply (own_word_nonempty es c 0), A; destruct robots; [congruence | cbn; lia]. }
    apply (check_invariant_sound _ _ _ _ _ _ equal_marked_eq _ _ _ _
      None (unread c) (own_word c es) H); [apply in_map_iff; eauto|].
    assert (E : forall d, map fst (unread d) = d)
      by (induction d as [|q d IH]; cbn; f_equal; auto).
    apply own_run; auto.
    - unfold unread; rewrite map_length; auto.
    - intros i Li; replace (snd (nth i (unread c) (0, false))) with false; [apply A; auto|].
      unfold unread; change (0, false) with ((fun q => (q, false)) 0); now rewrite map_nth.
  Qed.
End Own.
